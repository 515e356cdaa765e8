"""What is on the faces of printed cubes: the sheets are rasterised as a printer does it, and cut by a person."""

import numpy as np
import pypdfium2

from atg_fg.display.printed_sheets import net_squares

DOTS = 150 / 25.4  # a millimetre


def faces_of(path, side, paper="a4"):
    """Return the pictures on the faces of each cube, RGB."""
    cubes = []
    for sheet in pypdfium2.PdfDocument(path):
        page = sheet.render(scale=150 / 72).to_numpy()[:, :, :3]
        height = len(page) / DOTS
        faces = []
        for x, y, on_head in net_squares(side, paper):
            rows = slice(round((height - y - side) * DOTS), round((height - y) * DOTS))
            face = page[rows, round(x * DOTS) : round((x + side) * DOTS)]
            faces.append(np.ascontiguousarray(face[::-1, ::-1] if on_head else face))
        cubes.append(faces)
    return cubes
