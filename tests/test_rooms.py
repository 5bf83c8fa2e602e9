"""The rooms of the house: which may import which, how large they are, and that a name means one thing."""

from __future__ import annotations

import ast
import inspect
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.paths import ROOT
from support.source_trees import nodes_of, tree_of

# a room may import rooms on lower floors alone; those on one floor do not know each other
FLOORS: dict[str, tuple[tuple[str, ...], ...]] = {
    "cell": (
        (
            "arrays",
            "errors",
            "failure_facts",
            "freed_memory",
            "plain",
            "printable",
            "progress",
            "rigid",
            "shipped",
            "termination",
            "units",
        ),
        ("failure", "farthest_points", "json_text", "processes", "streams"),
        ("atomic_files",),
        ("case", "timing"),
        ("mjcf",),
        ("scene",),
        ("job", "collision"),
        ("motion", "compare", "coordination"),
        ("planning", "verification"),
        ("part_chunks", "table_poses"),
        ("verdict",),
        ("remedy_search", "pose_sweep", "programs"),
        ("report",),
        ("view",),
        ("html",),
        ("cli",),
        ("__init__", "__main__", "pytest_plugin"),
    ),
    "slicing": (
        ("errors", "warning"),
        ("annotations", "arrays"),
        ("parameters",),
        ("mesh",),
        ("surfaces",),
        ("curves", "decomposition"),
        ("layers",),
        ("volume",),
        ("beads",),
        ("strategies", "targets", "deposits"),
        ("paper", "toolpaths"),
        ("document",),
        ("__init__",),
    ),
}
LARGEST = 17  # modules of a room


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def name_of(path: Path) -> tuple[str, ...]:
    return path.relative_to(ROOT).with_suffix("").parts


def imports(path: Path) -> Iterator[tuple[str, ...]]:
    """Full names of what a file imports, those for type checking included, each with the name taken from it."""
    here = name_of(path)
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = here[: len(here) - node.level] if node.level else ()
            module = base + tuple(node.module.split(".") if node.module else ())
            yield from ((*module, alias.name) for alias in node.names)


@pytest.mark.parametrize("package", FLOORS)
def test_a_room_imports_lower_floors_alone(package: str) -> None:
    floor = {room: k for k, rooms in enumerate(FLOORS[package]) for room in rooms}
    wrong = []
    for path in modules(package):
        room = name_of(path)[1]
        for name in imports(path):
            if name[0] == package and len(name) > 1 and name[1] != room:
                other = name[1]
                if other in floor and floor[other] >= floor[room]:
                    wrong.append(f"{path.relative_to(ROOT)} imports {'.'.join(name)}")
                elif other not in floor:
                    assert room == "__init__", f"{path.relative_to(ROOT)}: {other} is no room of {package}"
    assert not wrong


@pytest.mark.parametrize("package", ["cell", "slicing", "ik"])
def test_modules_import_each_other_in_no_circle(package: str) -> None:
    names = {name_of(path): path for path in modules(package) if path.name != "__init__.py"}
    graph = {
        name: {found for full in imports(path) for found in (full, full[:-1]) if found in names and found != name}
        for name, path in names.items()
    }
    done: set[tuple[str, ...]] = set()

    def visit(name: tuple[str, ...], way: tuple[tuple[str, ...], ...]) -> None:
        assert name not in way, " -> ".join(".".join(n) for n in (*way, name))
        if name not in done:
            for other in sorted(graph[name]):
                visit(other, (*way, name))
            done.add(name)

    for name in sorted(graph):
        visit(name, ())


def test_the_judge_knows_nothing_of_the_planner() -> None:
    judge = modules("cell/verification")
    assert judge
    assert not [path for path in judge for name in imports(path) if name[:2] == ("cell", "planning")]


@pytest.mark.parametrize("package", ["slicing", "ik"])
def test_leaves_know_neither_each_other_nor_mujoco(package: str) -> None:
    others = {"cell", "slicing", "ik", "models", "mujoco"} - {package}
    assert not [path for path in modules(package) for name in imports(path) if name[0] in others]


def test_the_cell_takes_of_slicing_what_it_exports() -> None:
    import slicing

    for path in modules("cell"):
        for name in imports(path):
            if name[0] == "slicing":
                assert len(name) == 2, f"{path.relative_to(ROOT)} reaches into {'.'.join(name)}"
                assert name[1] in slicing.__all__


# where values by name may be of any kind, and why: elsewhere a class says what there is
ANY_VALUES = {
    "JSON, YAML or a page's data is made": """
        cell/case/problems cell/case/read cell/case/yaml12 cell/cli/console cell/cli/slice_command
        cell/cli/sweep_command cell/compare/compare cell/failure
        cell/html/check_page cell/html/comparison_page cell/html/pack cell/html/scene cell/html/series
        cell/html/shapes cell/html/sweep_page cell/html/page_words cell/job/part_input cell/motion/deposition_speed
        cell/programs/exported/export_document
        cell/pose_sweep/grid cell/pose_sweep/log cell/pose_sweep/picked_pose cell/pose_sweep/ranking
        cell/pose_sweep/sweep cell/pose_sweep/variants cell/remedy_search/changes cell/remedy_search/remedy
        cell/remedy_search/seam_changes cell/report/check_document cell/report/check_report
        cell/report/motion_report cell/report/program_document cell/report/sweep_lines
        cell/verdict/all_reasons cell/verdict/result cell/verdict/table_use cell/verdict/words
        cell/verification/bead_order cell/view/sweep_map_picture slicing/beads/overhang
        slicing/beads/thickness_policy slicing/decomposition/evidence_warnings slicing/document slicing/mesh/files/glb
        slicing/surfaces/cones slicing/surfaces/cylinders
        slicing/surfaces/planes slicing/surfaces/revolved_profiles slicing/warning""",
    "the variables of a KRL program": """
        cell/programs/krl/bas cell/programs/krl/data cell/programs/krl/state
        cell/programs/krl/values/evaluation cell/programs/krl/values/variable_scope""",
    "columns of a table, or keyword arguments": """
        cell/planning/edges/densify cell/programs/program cell/scene/workpiece""",
    "annotations of a class": "slicing/annotations slicing/parameters",
}


MAPPINGS = ("dict", "Mapping", "MutableMapping", "OrderedDict", "defaultdict")


def holds_values_of_any_kind(path: Path) -> bool:
    """Whether some annotation of a file is a mapping to Any or to object, however it is written."""
    for node in nodes_of(path):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple):
            name = ast.unparse(node.value).rpartition(".")[2]
            values = {one.strip().rpartition(".")[2] for one in ast.unparse(node.slice.elts[-1]).split("|")}
            if name in MAPPINGS and values & {"Any", "object"}:
                return True
    return False


def test_values_of_any_kind_stand_where_json_is_made_or_read() -> None:
    allowed = {f"{name}.py" for names in ANY_VALUES.values() for name in names.split()}
    found = {
        path.relative_to(ROOT).as_posix()
        for package in ("cell", "slicing", "ik")
        for path in modules(package)
        if holds_values_of_any_kind(path)
    }
    assert found == allowed


def test_every_room_names_its_modules() -> None:
    """The packages themselves are described in docs/architecture.md and the API's pages."""
    left_out, gone = [], []
    for package in ("cell", "slicing", "ik"):
        for init in (ROOT / package).rglob("*/__init__.py"):
            room, text = init.parent, ast.get_docstring(tree_of(init)) or ""
            there = {path.stem for path in room.glob("*.py")} | {
                path.parent.name for path in room.glob("*/__init__.py")
            }
            named = set(re.findall(r"``([a-z]\w*)``", text))
            left_out += [f"{room.relative_to(ROOT)}: {name}" for name in there - named if not name.startswith("__")]
            gone += [f"{room.relative_to(ROOT)}: {name}" for name in named - there - NO_MODULES]
    assert not left_out
    assert not gone


NO_MODULES = {"web", "table", "cell"}  # a folder of pages and scripts; a section of a case; who takes toolpaths


def test_tests_stand_in_the_rooms_of_what_they_test() -> None:
    """Every folder of tests is a room of the packages, and every room with modules of its own has tests."""
    rooms = {
        folder.relative_to(ROOT)
        for package in ("cell", "slicing", "ik")
        for folder in (ROOT / package).rglob("*")
        if folder.is_dir() and list(folder.glob("*.py"))
    }
    tests = {
        folder.relative_to(ROOT / "tests")
        for package in ("cell", "slicing", "ik")
        for folder in (ROOT / "tests" / package).rglob("*")
        if folder.is_dir() and list(folder.glob("test_*.py"))
    }
    assert tests == rooms


def test_no_room_is_too_large() -> None:
    folders = defaultdict(list)
    for top in ("cell", "slicing", "ik", "models", "tests", "bench", "docs"):
        for path in modules(top):
            if not path.name.startswith("__"):
                folders[path.parent].append(path.name)
    assert {
        str(folder.relative_to(ROOT)): len(names) for folder, names in folders.items() if len(names) > LARGEST
    } == {}


def stem(name: str) -> str:
    """A class name without what tells nobody anything: an underscore in front, an s, d or ed behind."""
    return re.sub(r"(?<=[^s])(s|d|ed)$", "", name.strip("_").lower())


def test_a_class_name_means_one_thing() -> None:
    found = defaultdict(list)
    for package in ("cell", "slicing", "ik"):
        for path in modules(package):
            for node in nodes_of(path):
                if isinstance(node, ast.ClassDef):
                    found[stem(node.name)].append(f"{path.relative_to(ROOT)}:{node.name}")
    assert {name: paths for name, paths in found.items() if len(paths) > 1} == {}


# functions of one name in several modules, and why they are one thing
SAME_FUNCTIONS = {
    "run": "of a command: cell/cli/main.py calls it by the name of the command",
    "solve": "of a way to solve the inverse kinematics, closed form or damped least squares",
}


def test_a_function_name_means_one_thing() -> None:
    found = defaultdict(list)
    for package in ("cell", "slicing", "ik"):
        for path in modules(package):
            for node in tree_of(path).body:
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                    found[node.name].append(str(path.relative_to(ROOT)))
    assert {name for name, paths in found.items() if len(paths) > 1} == set(SAME_FUNCTIONS)


@pytest.mark.parametrize("package", ["cell", "slicing", "ik"])
def test_what_a_package_exports_is_there(package: str) -> None:
    module = __import__(package)
    assert len(module.__all__) > 4
    for name in module.__all__:
        assert getattr(module, name) is not None


@pytest.mark.parametrize("package", ["cell", "slicing", "ik"])
def test_every_exported_function_says_what_it_takes(package: str) -> None:
    module, silent = __import__(package), []
    for name in module.__all__:
        one = getattr(module, name)
        members = vars(one).items() if inspect.isclass(one) else [("", one)]
        for member, function in members:
            if (
                not inspect.isfunction(function)
                or member.startswith("_")
                or function.__module__.split(".")[0] != package
            ):
                continue
            text = inspect.getdoc(function) or ""
            taken = [argument for argument in inspect.signature(function).parameters if argument not in ("self", "cls")]
            silent += [f"{name}.{member}: {argument}" for argument in taken if f"{argument}: " not in text]
    assert not silent


@pytest.mark.parametrize(
    ("annotation", "held"),
    [
        *[("dict[str, Any]", True), ("dict[str, object]", True), ("Mapping[str, Any | None]", True)],
        *[("typing.Mapping[str, typing.Any]", True), ("dict[str, float]", False), ("list[Any]", False)],
        ("dict[str, list[float]]", False),
    ],
)
def test_annotations_are_read_and_not_their_text(annotation: str, held: bool, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(f'"""Not of dict[str, Any]."""\n\n\ndef f(x: {annotation}) -> None: ...\n')
    assert holds_values_of_any_kind(tmp_path / "module.py") == held
