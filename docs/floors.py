"""Draws the packages on their floors, and who imports whom, as an SVG: ``python docs/floors.py``.

The floors are those that `make lint` holds, in pyproject.toml; the arrows are the imports in the code, those for types
alone and those inside functions included.
"""

from __future__ import annotations

import tomllib
from collections import Counter
from pathlib import Path
from typing import Final

import grimp

ROOT: Final = Path(__file__).parents[1]
PICTURE: Final = ROOT / "docs" / "images" / "floors.svg"
WIDTH, BOX_WIDTH, BOX_HEIGHT, FLOOR = 760, 200, 44, 92
COLORS: Final = ("#0069b4", "#c1440e", "#1b8a5a", "#8e44ad", "#b8860b", "#2c7a8c", "#a03060", "#555555")


def floors() -> list[list[str]]:
    """Return the packages by floor, the lowest first, as the contracts of import-linter say."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    below, above = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    inside = [[f"atg_fg.{name.strip(' ()')}" for name in layer.split("|")] for layer in reversed(below)]
    return inside + [[name] for name in reversed(above) if name != "atg_fg"]


def imports(packages: list[str]) -> tuple[Counter[str], Counter[tuple[str, str]]]:
    """Return the files of each package, and how many imports of files lead from each package to another."""
    graph = grimp.build_graph("atg_fg", "sim", "benchmarks", cache_dir=None)
    home = {
        module: package
        for module in graph.modules
        for package in packages
        if module == package or module.startswith(f"{package}.")
    }
    arrows = Counter(
        (home[module], home[target])
        for module in home
        for target in graph.find_modules_directly_imported_by(module)
        if target in home and home[target] != home[module]
    )
    return Counter(home.values()), arrows


def picture() -> str:
    """Return the SVG."""
    levels = floors()
    packages = [package for level in levels for package in level]
    files, arrows = imports(packages)
    height = FLOOR * len(levels) + 10
    place = {}
    for number, level in enumerate(levels):
        for column, package in enumerate(level, start=1):
            place[package] = (WIDTH * column / (len(level) + 1), height - FLOOR * (number + 0.5))
    color = {package: COLORS[number % len(COLORS)] for number, package in enumerate(packages)}
    lines = [_arrow(place[above], place[below], color[above], n) for (above, below), n in sorted(arrows.items())]
    boxes = [_box(package, *place[package], color[package], files[package]) for package in packages]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" '
            f'role="img" aria-label="{len(packages)} packages on {len(levels)} floors">',
            f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
            *lines,
            *boxes,
            "</svg>\n",
        ]
    )


def _arrow(above: tuple[float, float], below: tuple[float, float], color: str, n: int) -> str:
    """Return a curve from the foot of one box to the head of another, the wider the more imports it stands for."""
    (x, y), (to_x, to_y) = above, below
    y, to_y = y + BOX_HEIGHT / 2, to_y - BOX_HEIGHT / 2
    # Long arrows swing outwards, around the boxes between.
    swing = 0.0 if to_y - y < FLOOR else (1 if x + to_x >= WIDTH else -1) * 60 * (to_y - y) / FLOOR
    bend = (to_y - y) / 2
    return (
        f'<path d="M{x:.0f} {y:.0f}C{x + swing:.0f} {y + bend:.0f} {to_x + swing:.0f} {to_y - bend:.0f} '
        f'{to_x:.0f} {to_y:.0f}" fill="none" stroke="{color}" stroke-width="{0.8 + n**0.5 / 3:.1f}" '
        f'stroke-opacity="0.55"><title>{n} imports</title></path>'
    )


def _box(package: str, x: float, y: float, color: str, n: int) -> str:
    left, top = x - BOX_WIDTH / 2, y - BOX_HEIGHT / 2
    return (
        f'<rect x="{left:.0f}" y="{top:.0f}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="7" fill="#ffffff" '
        f'stroke="{color}" stroke-width="2"/><text x="{x:.0f}" y="{y - 2:.0f}" text-anchor="middle" font-size="15" '
        f'font-weight="600" fill="#1b2430">{package}</text><text x="{x:.0f}" y="{y + 15:.0f}" text-anchor="middle" '
        f'font-size="11" fill="#5a6472">{n} files</text>'
    )


if __name__ == "__main__":
    PICTURE.write_text(picture())
