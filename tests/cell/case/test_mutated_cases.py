"""Mutated case files, a fixed sample of those of bench/soundness/case_fuzz.py: each is read, or refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.soundness import case_fuzz as fuzz

READ, PREPARED, FIRST = 500, 8, 7_000_000


@pytest.mark.slow
def test_every_mutated_case_has_an_answer(tmp_path: Path) -> None:
    mutator, wrong, codes, good = fuzz.Mutator(), [], [], []
    fuzz.write_part(tmp_path)
    path = tmp_path / "fuzz.case.yaml"
    for seed in range(FIRST, FIRST + READ):
        text = mutator.text(seed)
        path.write_text(text, encoding="utf-8", errors="replace")
        code, found = fuzz.answer(path, "read")
        codes.append(code)
        if found is not None:
            wrong.append((seed, found))
        elif code == 0:
            good.append(seed)
    assert wrong == []
    assert READ / 8 < codes.count(0) < 7 * READ / 8  # the mutations do something, and not everything
    for seed in good[:PREPARED]:
        path.write_text(mutator.text(seed), encoding="utf-8", errors="replace")
        assert fuzz.answer(path, "prepare")[1] is None, seed


def test_a_seed_always_gives_the_same_case() -> None:
    one, other = fuzz.Mutator(), fuzz.Mutator()
    texts = [one.text(seed) for seed in range(20)]
    assert texts == [other.text(seed) for seed in range(20)]
    assert len(set(texts)) == 20


def test_a_wrong_answer_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> None:
        raise KeyError("x")

    monkeypatch.setattr("cell.case.read.load_case", fail)
    assert fuzz.answer(tmp_path / "any.case.yaml", "read")[1].startswith("KeyError")
