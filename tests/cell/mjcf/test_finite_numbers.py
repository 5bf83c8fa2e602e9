"""Numbers of a model that are none are refused: MuJoCo compiles them, and a shape that is nowhere touches nothing."""

import pytest
from support.cells.cell_models import ARM, TABLE, TORCH, write_case

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare

FOOT, COLUMN, HOSE = '<geom name="foot"', '<geom name="column"', '<geom name="hose"'
TABLE_SITE, TCP = '<site name="table" pos="0 0 0.15"/>', '<site name="tcp" pos="0 0 0.357"/>'


def ball(more: str, before: str) -> tuple[str, str]:
    return before, f'<geom name="x" type="sphere" size="0.05" {more}/>{before}'


ODD = {
    "place of a shape": ("arm", *ball('pos="nan 0 0"', FOOT), "geom x: its pos is nan"),
    "place of a shape without contact": ("arm", *ball('contype="0" conaffinity="0" pos="0 0 nan"', FOOT), "geom x"),
    "far off": ("arm", *ball('pos="1e8 0 0"', FOOT), r"geom x: its pos is 1e\+08"),
    "turn of a shape": ("table", *ball('quat="1 nan 0 0"', COLUMN), "geom x: its quat is nan"),
    "a shape of the torch": ("torch", *ball('mass="0" pos="0 nan 0"', HOSE), "geom x: its pos is nan"),
    "range": ("arm", 'range="-3.14 3.14"', 'range="-3.14 nan"', "joint A4: its range is nan"),
    "endless range": ("arm", 'range="-3.14 3.14"', 'range="-inf inf"', "joint A4: its range is -inf"),
    "axis": ("arm", 'name="A4" axis="-1 0 0"', 'name="A4" axis="nan 0 0"', "joint A4: its axis is nan"),
    "anchor": ("arm", 'name="A4"', 'name="A4" pos="nan 0 0"', "joint A4: its pos is nan"),
    "reference": ("arm", 'name="A4"', 'name="A4" ref="nan"', "joint A4: its ref is nan"),
    "link": ("arm", '"link_5" pos="1.035 0 0"', '"link_5" pos="nan 0 0"', "body link_5: its pos is nan"),
    "tcp": ("torch", TCP, TCP.replace("0 0 0.357", "0 nan 0.357"), "site tcp: its pos is nan"),
    "table": ("table", TABLE_SITE, TABLE_SITE.replace("0 0", "nan 0", 1), "site table: its pos is nan"),
    "range of the table": ("table", 'range="-135 135"', 'range="nan 135"', "joint E1: its range is nan"),
    "speed": ("arm", "180 158", "inf 158", "max_speed_deg_s needs 6 positive values"),
    "mesh": (
        "arm",
        "<worldbody>",
        '<asset><mesh name="m" scale="nan 1 1" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/></asset><worldbody>'
        '<geom type="mesh" mesh="m"/>',
        "nan|not a number",
    ),
}


@pytest.mark.parametrize("what", ODD)
def test_a_number_that_is_none_is_refused_with_its_place(tmp_path, what):
    model, text, by, words = ODD[what]
    texts = {"arm": ARM, "torch": TORCH, "table": TABLE}
    assert texts[model].count(text) == 1
    texts[model] = texts[model].replace(text, by)
    with pytest.raises(InputError, match=words) as raised:
        prepare(load_case(write_case(tmp_path, "odd", **texts)))
    assert "\n" not in str(raised.value)
