"""Diagrams: pictures in rows and columns, with words below them and arrows between them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from PIL import Image, ImageDraw

from gallery_tools.drawing import INK, PAPER, text

__all__ = ["CELL", "Node", "flow"]

CELL = (240, 200)
"""Room for a picture, width and height; larger ones are reduced."""

_GAP_X, _GAP_Y, _LINE, _EDGE = 62, 46, 22, 24
_FRAME = (150, 154, 162)


class Node(NamedTuple):
    """One step: a picture, the lines below it, and its place in the diagram, columns and rows from 0."""

    image: Any
    lines: tuple[str, ...]
    column: int
    row: int


def flow(nodes: Sequence[Node], arrows: Sequence[tuple[int, int]]) -> Any:
    """Draw a diagram; an arrow runs from one node to another, by their numbers in `nodes`."""
    width, height = CELL
    lines = max(len(node.lines) for node in nodes)
    step_x, step_y = width + _GAP_X, height + lines * _LINE + _GAP_Y
    columns = 1 + max(node.column for node in nodes)
    rows = 1 + max(node.row for node in nodes)
    size = 2 * _EDGE + columns * step_x - _GAP_X, 2 * _EDGE + rows * step_y - _GAP_Y
    sheet = Image.new("RGB", size, PAPER)
    draw = ImageDraw.Draw(sheet)
    boxes = []
    for node in nodes:
        left, top = _EDGE + node.column * step_x, _EDGE + node.row * step_y
        picture = node.image.copy()
        picture.thumbnail((width - 8, height - 8))
        draw.rectangle((left, top, left + width, top + height), outline=_FRAME, width=1)
        sheet.paste(picture, (left + (width - picture.width) // 2, top + (height - picture.height) // 2))
        for n, words in enumerate(node.lines):
            place = (left + width / 2, top + height + (n + 0.7) * _LINE)
            text(draw, place, words, size=17, align=0.5)
        boxes.append((left, top, left + width, top + height, top + height + len(node.lines) * _LINE + 4))
    for start, end in arrows:
        _arrow(draw, boxes[start], boxes[end], sideways=nodes[start].row == nodes[end].row)
    return sheet


def _arrow(draw: Any, start: tuple[int, ...], end: tuple[int, ...], *, sideways: bool) -> None:
    """Draw an arrow to the next box in a row, or round a corner to a box above or below."""
    middle = (start[1] + start[3]) // 2
    if sideways:
        line = [(start[2] + 4, middle), (end[0] - 4, middle)]
        way = (1, 0)
    else:
        x, up = (end[0] + end[2]) // 2, end[1] < start[1]
        aim = (x, end[4] + 4) if up else (x, end[1] - 4)
        same = start[0] == end[0]
        below = start[1] - 4 if up else start[4] + 4
        line = [(x, below), aim] if same else [(start[2] + 4, middle), (x, middle), aim]
        way = (0, -1) if up else (0, 1)
    tip = line[-1]
    back = tip[0] - 14 * way[0], tip[1] - 14 * way[1]
    draw.line([*line[:-1], back], fill=INK, width=3, joint="curve")
    side = 8 * way[1], 8 * way[0]
    draw.polygon([tip, (back[0] + side[0], back[1] + side[1]), (back[0] - side[0], back[1] - side[1])], INK)
