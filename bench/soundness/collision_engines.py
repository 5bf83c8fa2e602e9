"""MuJoCo's collision detection, as scenes use it, against a second engine (coal): pairs of all kinds, and whole cells.

    python -m bench.soundness.collision_engines  # 400 random cells, 50 configurations each: 20,000
    python -m bench.soundness.collision_engines --pairs 2000  # as many configurations of every pair of kinds
    python -m bench.soundness.collision_engines --cells 20 --each 10 --seed 5

Missed is what MuJoCo calls free and coal calls deeper than 0.2 mm; wrong is a distance within the reach that differs by
more than 0.1 mm. Cells are of all kinds of shapes that a model may hold, and the second engine goes through all pairs:
the broad phase is held against that as well. Exit code 1 if anything is missed or wrong.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from itertools import combinations_with_replacement
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np

from cell import InputError, compose, prepare
from cell.collision.checker import Checker
from cell.mjcf.detection import make_detectable
from tests.support.cells.random_cells import KINDS, put, random_cell, random_pair, write_meshes
from tests.support.oracles.second_engine import SecondEngine, placed, shape_of, signed_distance

from ..bench_arguments import parsed

DEEP, EXACT, REACH = 2e-4, 1e-4, 0.05
EVERY = 20.0  # s between two lines of cells: a run that is cut off has told what it found


def detectable(spec: mujoco.MjSpec) -> None:
    make_detectable(spec, SimpleNamespace(path="pair"))


def pairs(count: int, seed: int, low: float) -> int:
    """Every pair of kinds in random sizes and places; how many configurations were missed or wrong."""
    bad = 0
    for one, two in combinations_with_replacement(KINDS, 2):
        if one == two == "plane":
            continue
        rng = np.random.default_rng((seed, KINDS.index(one), KINDS.index(two)))
        deep = missed = wrong = 0
        worst = 0.0
        for _ in range(-(-count // 20)):
            plain, model = random_pair(rng, one, two, detectable, low)
            datas = [mujoco.MjData(plain), mujoco.MjData(model)]
            shapes = [shape_of(plain, g) for g in range(2)]
            reach = float(rng.choice([6e-4, 5e-3, 0.05, 0.3]))
            model.geom_gap[:], model.body_margin[:] = reach / 2, reach / 2
            for _ in range(20):
                put(rng, datas)
                true = signed_distance(shapes[0], placed(datas[0], 0), shapes[1], placed(datas[0], 1))
                mujoco.mj_collision(model, datas[1])
                found = float(datas[1].contact.dist.min()) if datas[1].ncon else np.inf
                if true < -DEEP:
                    deep += 1
                    missed += found >= 0
                    worst = max(worst, -true if found >= 0 and np.isfinite(true) else 0.0)
                elif true > 0:
                    wrong += abs(min(found, reach) - min(true, reach)) > EXACT
        bad += missed + wrong
        print(
            f"{one:9} {two:9} deep {deep:5}  missed {missed:3} (worst {worst * 1e3:.1f} mm)  wrong {wrong:3}",
            flush=True,
        )
    return bad


def cells(count: int, each: int, seed: int) -> int:
    """Random configurations of random cells; how many were missed or wrong."""
    rng = np.random.default_rng(seed)
    deep = near = missed = wrong = done = refused = 0
    began = told = time.perf_counter()

    def tell() -> None:
        print(
            f"{done} cells, {done * each} configurations, {deep} deeper than 0.2 mm, {near} within "
            f"{REACH * 1e3:.0f} mm: missed {missed}, wrong {wrong}, cells refused {refused}; "
            f"{time.perf_counter() - began:.0f} s",
            flush=True,
        )

    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        write_meshes(place)
        part = prepare(random_cell(rng, place)).shape
        while done < count:
            case = random_cell(rng, place)
            try:
                scene = compose(case, part)
            except InputError as error:
                refused += 1
                print(error, flush=True)
                if refused > count:
                    raise
                continue
            done += 1
            other = SecondEngine(scene, case, part)
            table = rng.uniform(*scene.table_range.T)
            q = rng.uniform(scene.chain.lower, scene.chain.upper, (each, scene.chain.n))
            deposits_laid = rng.integers(0, scene.n_deposits + 1, each)
            found = Checker(scene, tuple(table), REACH).clearances(q, deposits_laid)
            for k in range(each):
                true, pair = other.nearest(q[k], table, int(deposits_laid[k]), REACH)
                was = float(found.distance[k])
                deep, near = deep + (true < -DEEP), near + (0 < true < REACH)
                lost = true < -DEEP and was >= 0
                off = true > 0 and abs(min(was, REACH) - min(true, REACH)) > EXACT
                missed, wrong = missed + lost, wrong + off
                if lost or off:
                    names = [scene.geom_name(int(g)) for g in pair]
                    print(f"cell {done} {names}: {was * 1e3:.3f} mm, second engine {true * 1e3:.3f} mm", flush=True)
            if time.perf_counter() - told > EVERY:
                told = time.perf_counter()
                tell()
    tell()
    return missed + wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=400)
    parser.add_argument("--each", type=int, default=50, help="configurations of every cell")
    parser.add_argument("--pairs", type=int, default=0, help="configurations of every pair of kinds instead")
    parser.add_argument("--least-mm", type=float, default=3.0, help="least half size of the shapes of pairs")
    parser.add_argument("--seed", type=int, default=1)
    args = parsed(parser, cells=4, each=5)
    bad = pairs(args.pairs, args.seed, args.least_mm * 1e-3) if args.pairs else cells(args.cells, args.each, args.seed)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
