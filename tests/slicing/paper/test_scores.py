"""The paper's scores: its own printed figures, the equations' edges, and what must hold of any of them."""

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from support.paths import ROOT

from slicing.paper.indices import Indices
from slicing.paper.scores import scores, scores_of

TABLES = ROOT / "models" / "parts" / "paper_tables.yaml"
ROWS = yaml.safe_load(TABLES.read_text(encoding="utf-8"))["rows"]
columns = arrays.arrays(np.float64, (4, 3), elements=st.floats(0, 1e6))


def of_row(row):
    return scores(row["NL"], row["A"], row["NV"], row["R"])


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row["F"]])
def test_the_papers_totals_follow_from_its_indices(name):
    # tables 6 to 9, rounded after computing
    assert np.allclose(of_row(ROWS[name]).F, ROWS[name]["F"], atol=0.02)


def test_the_total_that_is_cut_off_follows_from_its_row():
    assert np.allclose(of_row(ROWS["boiler/SV1"]).F, [2.34, 1.83, 2.83], atol=0.005)


def test_the_propellers_scores_are_those_of_table_6():
    found = of_row(ROWS["propeller/SV1"])
    assert np.allclose(found.I1, [0.65, 0.69, 0.66], atol=0.01)
    assert np.allclose(found.I2, [0.14, 0.43, 0.43], atol=0.01)
    assert np.allclose(found.I3, [0.71, 0.63, 0.67], atol=0.01)
    assert np.allclose(found.I4, [0.66, 0.72, 0.62], atol=0.01)
    assert found.best == 1


def test_a_column_of_zeros_is_shared_out_as_nothing():
    found = scores([2, 2], [0, 0], [0, 0], [0, 0])
    assert found.I4.tolist() == [1, 1]
    assert found.I3.tolist() == [1, 1]
    assert found.I2.tolist() == [0, 0]


def test_one_strategy_alone_gets_what_the_equations_say():
    found = scores([7], [3.0], [50], [0.2])
    assert [found.I1[0], found.I2[0], found.I3[0], found.I4[0]] == [0, 1, 0, 0]


def test_rounding_is_no_angle():
    found = scores_of([Indices(3, 10.0, 9, 2e-8), Indices(3, 10.0, 9, 0.0), Indices(3, 10.0, 9, 1e-9)])
    assert found.I4.tolist() == [1, 1, 1]
    assert found.best == 0  # of equals the first


def test_plain_numbers_for_one_strategy():
    found = scores_of([Indices(1, 1.0, 3, 0.1), Indices(3, 3.0, 1, 0.1)])
    assert found.to_dict(1) == pytest.approx({"I1": 0.25, "I2": 0.75, "I3": 0.75, "I4": 0.5, "F": 2.25})


@given(columns)
def test_scores_lie_within_their_bounds_and_add_up(table):
    found = scores(*table)
    for one in (found.I1, found.I2, found.I3, found.I4):
        assert (one >= -1e-12).all()
        assert (one <= 1 + 1e-12).all()
    assert np.allclose(found.F, found.I1 + found.I2 + found.I3 + found.I4)


@given(columns.filter(lambda t: (t.sum(axis=1) > 1e-300).all()))
def test_shares_sum_to_one(table):
    found = scores(*table)
    assert np.allclose([found.I1.sum(), found.I2.sum(), found.I3.sum(), found.I4.sum()], [2, 1, 2, 2])


@given(columns, st.permutations(range(3)))
def test_the_order_of_strategies_does_not_matter(table, order):
    assert np.allclose(scores(*table[:, list(order)]).F, scores(*table).F[list(order)])


def test_a_batch_is_the_same_as_one_by_one():
    rows = list(ROWS.values())
    batch = scores(*(np.array([row[key] for row in rows]) for key in ("NL", "A", "NV", "R")))
    assert np.allclose(batch.F, [of_row(row).F for row in rows])
    assert batch.best.tolist() == [int(of_row(row).best) for row in rows]


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (([1, 2], [1, 2, 3], [1, 2], [0, 0]), "A: shape"),
        (([], [], [], []), "at least one strategy"),
        ((1, 1, 1, 1), "at least one strategy"),
        (([1, 2], [1, 2], [1, -2], [0, 0]), "NV: "),
        (([1, 2], [1, 2], [1, 2], [0, float("nan")]), "R: "),
    ],
)
def test_what_it_refuses(table, says):
    with pytest.raises(ValueError, match=says):
        scores(*table)
