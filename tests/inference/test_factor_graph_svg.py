import xml.etree.ElementTree as ElementTree

from atg_fg.inference.factor_graph_svg import recognition_svg


def test_every_variable_is_a_circle_and_every_factor_a_square():
    names = [("O",), ("O", "X0"), ("O", "X0", "X1"), ("O", "X0"), ("O", "X1")]
    root = ElementTree.fromstring(recognition_svg([("O", "X0", "X1")], names))
    kinds = [element.tag.rpartition("}")[2] for element in root.iter()]
    assert kinds.count("circle") == 3
    assert kinds.count("rect") == 5
    assert kinds.count("line") == sum(map(len, names))
    squares = [(e.get("x"), e.get("y")) for e in root.iter() if e.tag.endswith("rect")]
    assert len(set(squares)) == 5
