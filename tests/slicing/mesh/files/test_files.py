"""Files as other programs write them: polygons, relative indices, components, paddings, counts that lie."""

from __future__ import annotations

import importlib.util
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from slicing.mesh.files.stl import read_stl
from slicing.mesh.files.three_mf import read_3mf
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import Mesh, PartError, low_part_warnings
from slicing.warning import Code

# a U: two legs 8 long, joined at x 6 .. 10
U = np.array([[0, 0], [10, 0], [10, 9], [0, 9], [0, 6], [6, 6], [6, 3], [0, 3]], dtype=float)
U_MM2 = 10 * 9 - 6 * 3
BOX = trimesh.creation.box(extents=(10, 20, 30))
IDENTITY = "1 0 0 0 1 0 0 0 1 0 0 0"


def prism(outline: np.ndarray, begin: int, height: float) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices and polygons of a prism; its ends begin at a corner of the outline."""
    n = len(outline)
    points = np.concatenate([np.c_[outline, np.zeros(n)], np.c_[outline, np.full(n, height)]])
    order = [(begin + k) % n for k in range(n)]
    sides = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
    return points, [order[::-1], [n + k for k in order], *sides]


def write_polygons(file: Path, points: np.ndarray, polygons: list[list[int]]) -> Path:
    vertices = "\n".join(" ".join(str(v) for v in point) for point in points)
    faces = "\n".join(f"{len(p)} {' '.join(map(str, p))}" for p in polygons)
    if file.suffix == ".obj":
        text = "".join(f"v {line}\n" for line in vertices.splitlines())
        text += "o u\nusemtl steel\ng ends\n" + "".join(f"f {' '.join(f'{k + 1}//1' for k in p)}\n" for p in polygons)
    elif file.suffix == ".off":
        text = f"OFF\n# made by hand\n{len(points)} {len(polygons)} 0\n{vertices}\n{faces}\n"
    else:
        head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
        head += f"property float z\nelement face {len(polygons)}\nproperty list uchar int vertex_indices\nend_header\n"
        text = head + vertices + "\n" + faces + "\n"
    file.write_text(text)
    return file


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off"])
def test_concave_polygons_are_divided_within_themselves_wherever_they_begin(suffix, tmp_path):
    for begin in range(len(U)):
        mesh = load_mesh(write_polygons(tmp_path / f"u{begin}{suffix}", *prism(U, begin, 5.0)))
        assert mesh.warnings == ()
        assert mesh.volume == pytest.approx(5 * U_MM2)
        # no face of the ends lies outside the U: their areas add up to it
        flat = np.abs(mesh.normals[:, 2]).sum() / 2
        assert flat == pytest.approx(2 * U_MM2)


def test_a_polygon_whose_border_crosses_itself_is_refused(tmp_path):
    bow = np.array([[0, 0], [10, 10], [10, 0], [0, 6]], dtype=float)
    with pytest.raises(PartError, match=r"polygon 1 of 6 .* crosses itself"):
        load_mesh(write_polygons(tmp_path / "bow.obj", *prism(bow, 0, 5.0)))


def test_warped_polygons_are_told_of(tmp_path):
    points, polygons = prism(U, 0, 5.0)
    points[-1, 2] += 1.0
    (line,) = load_mesh(write_polygons(tmp_path / "warped.obj", points, polygons)).warnings
    assert line.code == Code.POLYGON_NOT_FLAT


def test_relative_indices_count_from_where_they_stand(tmp_path):
    text = "mtllib x.mtl\n"
    for k in range(3):
        box = BOX.copy().apply_translation((30 * k, 0, 0))
        text += f"o {k}\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in box.vertices)
        shift = 8 * k + 1 if k == 0 else -8
        text += "".join(f"f {a + shift} {b + shift} \\\n {c + shift}\n" for a, b, c in box.faces)
    (tmp_path / "relative.obj").write_text(text)
    mesh = load_mesh(tmp_path / "relative.obj")
    assert (mesh.volume, mesh.warnings) == (pytest.approx(3 * 6000), ())
    assert mesh.bounds[1, 0] == pytest.approx(65)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("f 1 2 9", "a face names vertex 9; the file has 3"),
        ("f 1 2 -4", "line 4: a face names vertex -4; 3 are read there"),
        ("f 1 2 0", "names vertex 0"),
        ("f 1 2 x", "line 4: 'x' does not name a vertex"),
        ("v 1,5 2,0 3,0", "with a point, not a comma"),
        ("surf 0 1 0 1 1 2 3", "free-form geometry"),
    ],
)
def test_obj_files_that_cannot_be_read_name_the_line(line, says, tmp_path):
    (tmp_path / "x.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{line}\n")
    with pytest.raises(PartError) as caught:
        load_mesh(tmp_path / "x.obj")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_stl_bytes_after_the_last_triangle_are_told_of(tmp_path):
    data = BOX.export(file_type="stl")
    (tmp_path / "x.stl").write_bytes(b"solid of a binary file".ljust(80) + data[80:] + bytes(17))
    mesh = load_mesh(tmp_path / "x.stl")
    assert mesh.volume == pytest.approx(6000)
    (line,) = mesh.warnings
    assert line.code == Code.MESH_FILE
    assert "17 bytes after the last triangle" in line
    (tmp_path / "two.stl").write_bytes(
        data + trimesh.creation.box(bounds=[(20, 0, 0), (21, 1, 1)]).export(file_type="stl")
    )
    mesh = load_mesh(tmp_path / "two.stl")
    assert mesh.volume == pytest.approx(6001)
    assert "2 binary STL files one after the other" in mesh.warnings[0]
    (tmp_path / "short.stl").write_bytes(data[:-20])
    with pytest.raises(PartError, match=r"counts 12 triangles, which take 684 bytes; the file has 664"):
        load_mesh(tmp_path / "short.stl")


def test_text_stl_of_several_named_solids(tmp_path):
    other = BOX.copy().apply_translation((0, 0, 50))
    text = BOX.export(file_type="stl_ascii") + other.export(file_type="stl_ascii")
    named = text.replace("solid", "solid vertex 1 2 3", 1).replace("\n", "\r\n")
    (tmp_path / "x.stl").write_text(named)
    assert load_mesh(tmp_path / "x.stl").volume == pytest.approx(12000)
    (tmp_path / "comma.stl").write_text(text.replace(".", ","))
    with pytest.raises(PartError, match="with a point, not a comma"):
        load_mesh(tmp_path / "comma.stl")
    (tmp_path / "cut.stl").write_text(text.rsplit("vertex", 1)[0])
    with pytest.raises(PartError, match="a facet needs three vertices"):
        load_mesh(tmp_path / "cut.stl")


def test_ply_of_big_endian_with_further_properties_and_elements(tmp_path):
    head = "ply\nformat binary_big_endian 1.0\ncomment x\nelement vertex 8\nproperty uchar red\nproperty double x\n"
    head += "property float y\nproperty float z\nelement edge 1\nproperty list uchar int way\nelement face 12\n"
    head += "property list ushort uint vertex_index\nproperty list uchar float texcoord\nend_header\n"
    data = head.encode()
    data += b"".join(struct.pack(">Bdff", 7, x, y, z) for x, y, z in BOX.vertices)
    data += struct.pack(">Bii", 2, 0, 1)
    for k, (a, b, c) in enumerate(BOX.faces):  # lists that differ in length
        data += struct.pack(">HIII", 3, a, b, c) + struct.pack(">B" + "f" * (k % 2), k % 2, *[0.5] * (k % 2))
    (tmp_path / "x.ply").write_bytes(data)
    mesh = load_mesh(tmp_path / "x.ply")
    assert (mesh.volume, mesh.warnings) == (pytest.approx(6000), ())


@pytest.mark.parametrize("index", [8, -4])
def test_a_face_without_its_vertex_is_one_line(index, tmp_path):
    faces = BOX.faces.tolist()
    faces[3][1] = index
    with pytest.raises(PartError, match=r"a face names a vertex outside 0 \.\. 7"):
        load_mesh(write_polygons(tmp_path / "x.ply", BOX.vertices, faces))
    with pytest.raises(PartError, match=r"a face names a vertex outside 0 \.\. 7"):
        load_mesh(write_polygons(tmp_path / "x.off", BOX.vertices, faces))


def glb_with(tmp_path: Path, change) -> Path:
    """A scene of two boxes as GLB, its JSON changed."""
    scene = trimesh.Scene([BOX, BOX.copy().apply_translation((0, 0, 50))])
    data = scene.export(file_type="glb")
    length = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20 : 20 + length])
    rest = bytearray(data[20 + length :])
    change(document, rest)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON")
    (tmp_path / "x.glb").write_bytes(head + text + bytes(rest))
    return tmp_path / "x.glb"


def test_a_glb_face_never_takes_a_vertex_of_the_next_mesh(tmp_path):
    def one_beyond(document, rest):
        accessor = document["accessors"][document["meshes"][0]["primitives"][0]["indices"]]
        at = 8 + document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        size = {5121: "<B", 5123: "<H", 5125: "<I"}[accessor["componentType"]]
        struct.pack_into(size, rest, at, 8)

    with pytest.raises(PartError, match=r"outside 0 \.\. 7"):
        load_mesh(glb_with(tmp_path, one_beyond))


def test_strips_of_a_ply_are_refused_and_not_left_out(tmp_path):
    write_polygons(tmp_path / "x.ply", BOX.vertices, BOX.faces)
    load_mesh(tmp_path / "x.ply")
    for rows, refused in ((0, False), (1, True)):
        text = (tmp_path / "x.ply").read_text()
        text = text.replace("end_header", f"element tristrips {rows}\nproperty list int int vertex_indices\nend_header")
        (tmp_path / "strips.ply").write_text(text + "4 0 1 2 3\n" * rows)
        if refused:
            with pytest.raises(PartError, match=r"strips\.ply: has triangle strips"):
                load_mesh(tmp_path / "strips.ply")
        else:
            load_mesh(tmp_path / "strips.ply")


def sparse(document, rest):
    document["accessors"][1]["sparse"] = {"count": 1}


def instances(document, rest):
    document["nodes"][-1]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}


def needs(document, rest):
    document["extensionsRequired"] = ["EXT_meshopt_compression"]


def skinned(document, rest):
    next(node for node in document["nodes"] if "mesh" in node)["skin"] = 0


def blended(document, rest):
    document["meshes"][1]["weights"] = [0.0, 0.5]


def fan(document, rest):
    primitive = document["meshes"][1]["primitives"][0]
    document["meshes"][1]["primitives"].append({**primitive, "mode": 6})


def normalized(document, rest):
    position = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    document["accessors"][position]["normalized"] = True


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (sparse, "the file has a sparse array"),
        (instances, "a node has instances"),
        (needs, "the file needs the extension EXT_meshopt_compression"),
        (skinned, "a mesh has a skin"),
        (blended, "a mesh is blended with morph targets"),
        (fan, "a mesh has triangle fans"),
        (normalized, "a mesh has normalized positions"),
    ],
)
def test_what_trimesh_passes_over_in_a_glb_is_refused(tmp_path, change, why):
    """It was read as if it were not there: one of many instances, a scene without its fans, an unbent mesh."""
    with pytest.raises(PartError, match=rf"x\.glb: {why}.*, which is not read: export plain triangles"):
        load_mesh(glb_with(tmp_path, change))


def test_what_changes_no_triangle_of_a_glb_is_no_matter(tmp_path):
    def harmless(document, rest):
        document["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]
        document["meshes"][1]["weights"] = [0.0]
        primitive = document["meshes"][0]["primitives"][0]
        lines = {**primitive, "mode": 1}
        lines.pop("indices")
        document["meshes"][0]["primitives"].append(lines)

    plain = load_mesh(glb_with(tmp_path, lambda *_: None))
    mesh = load_mesh(glb_with(tmp_path, harmless))
    assert mesh.volume == pytest.approx(plain.volume)
    assert len(mesh.faces) == len(plain.faces)


def test_counts_that_no_file_holds_are_refused_before_memory_is_taken(tmp_path):
    def huge(document, rest):
        document["accessors"][0]["count"] = 4_000_000_000

    head = "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "v.ply").write_text(head.format(4_000_000_000, 1))
    (tmp_path / "f.ply").write_text(head.format(1, 4_000_000_000))
    (tmp_path / "x.stl").write_bytes(bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(100))
    (tmp_path / "x.off").write_text("OFF\n4000000000 1 0\n0 0 0\n")
    files = [tmp_path / "v.ply", tmp_path / "f.ply", tmp_path / "x.stl", tmp_path / "x.off", glb_with(tmp_path, huge)]
    for file in files:
        with pytest.raises(PartError) as caught:
            load_mesh(file)
        assert file.name in str(caught.value)
        assert "\n" not in str(caught.value)


def mesh_xml(number: int, mesh: trimesh.Trimesh, kind: str = "model") -> str:
    points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    return (
        f'<object id="{number}" type="{kind}"><mesh><vertices>{points}</vertices><triangles>{faces}</triangles></mesh>'
        "</object>"
    )


def write_3mf(file: Path, files: dict[str, str], settings: str = "", required: str = "p") -> Path:
    """A 3MF of model files (path: resources, then build), in the production extension's way."""
    space = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
    space += ' xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" xmlns:q="http://x.org/q"'
    kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    rels = '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship'
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("_rels/.rels", f'{rels} Target="/3D/3dmodel.model" Id="r" Type="{kind}"/></Relationships>')
        for path, text in files.items():
            text = f'<model unit="millimeter" requiredextensions="{required}" {space}>{text}</model>'
            archive.writestr(path, text)
        if settings:
            archive.writestr("Metadata/model_settings.config", settings)
    return file


PARTS = "".join(mesh_xml(k, BOX) for k in (1, 2, 3))
COMPONENT = '<component p:path="/3D/Objects/o.model" objectid="{}" transform="{}"/>'
TURNED = "0 1 0 -1 0 0 0 0 1 100 0 0"  # x becomes y: a quarter turn, then 100 along x


def assembly(*components: str, item: str = "1 0 0 0 1 0 0 0 1 0 0 7") -> dict[str, str]:
    root = f'<resources><object id="8" type="model"><components>{"".join(components)}</components></object></resources>'
    root += f'<build><item objectid="8" transform="{item}"/></build>'
    return {"3D/3dmodel.model": root, "3D/Objects/o.model": f"<resources>{PARTS}</resources><build/>"}


def test_3mf_components_are_put_together_once_each(tmp_path):
    file = write_3mf(tmp_path / "x.3mf", assembly(COMPONENT.format(1, IDENTITY), COMPONENT.format(2, TURNED)))
    found = read_3mf(file)
    assert len(found.faces) == 24
    first, second = found.vertices[:8], found.vertices[8:]
    assert np.allclose([first.min(axis=0), first.max(axis=0)], [(-5, -10, -8), (5, 10, 22)])
    assert np.allclose([second.min(axis=0), second.max(axis=0)], [(90, -5, -8), (110, 5, 22)])
    mirrored = "-1 0 0 0 1 0 0 0 1 0 0 0"
    file = write_3mf(tmp_path / "m.3mf", assembly(COMPONENT.format(1, mirrored)))
    mesh = load_mesh(file)
    assert (mesh.volume, mesh.warnings) == (pytest.approx(6000), ())


def test_3mf_parts_that_are_no_part_of_the_solid_are_left_out(tmp_path):
    far = "1 0 0 0 1 0 0 0 1 50 0 0"
    files = assembly(COMPONENT.format(1, IDENTITY), COMPONENT.format(2, far), COMPONENT.format(3, far))
    settings = '<config><object id="8"><part id="1" subtype="normal_part"/><part id="2" subtype="{}"/>'
    settings += '<part id="3" subtype="support_blocker"/></object></config>'
    mesh = load_mesh(write_3mf(tmp_path / "x.3mf", files, settings.format("modifier_part")))
    assert mesh.volume == pytest.approx(6000)
    assert [line.split(": ")[1] for line in mesh.warnings] == ["left out 1 modifier", "left out 1 support blocker"]
    with pytest.raises(PartError, match="to be subtracted"):
        load_mesh(write_3mf(tmp_path / "n.3mf", files, settings.format("negative_part")))
    typed = f"<resources>{mesh_xml(1, BOX)}{mesh_xml(2, BOX, 'support')}</resources><build>"
    typed += f'<item objectid="1"/><item objectid="2" transform="{far}"/><item objectid="1" printable="0"/></build>'
    mesh = load_mesh(write_3mf(tmp_path / "s.3mf", {"3D/3dmodel.model": typed}))
    assert mesh.volume == pytest.approx(6000)
    assert any("left out 1 support" in line for line in mesh.warnings)


def test_a_beam_lattice_of_a_3mf_is_refused_and_not_left_out(tmp_path):
    """A file need not require its extension, so that its beams were passed over."""
    beams = "<beamlattice><beams><beam v1='0' v2='5'/></beams></beamlattice></mesh>"
    built = f"<resources>{mesh_xml(1, BOX).replace('</mesh>', beams)}</resources><build><item objectid='1'/></build>"
    with pytest.raises(PartError, match=r"x\.3mf: has a beam lattice, which is not read"):
        load_mesh(write_3mf(tmp_path / "x.3mf", {"3D/3dmodel.model": built}))


def test_3mf_files_that_are_not_understood_are_one_line(tmp_path):
    files = assembly(COMPONENT.format(1, IDENTITY))
    with pytest.raises(PartError, match=r"needs the 3MF extension http://x\.org/q"):
        load_mesh(write_3mf(tmp_path / "q.3mf", files, required="p q"))
    with pytest.raises(PartError, match="the file names object 9, which is not in"):
        load_mesh(write_3mf(tmp_path / "9.3mf", assembly(COMPONENT.format(9, IDENTITY))))
    itself = files["3D/3dmodel.model"].replace('p:path="/3D/Objects/o.model" objectid="1"', 'objectid="8"')
    with pytest.raises(PartError, match="is a component of itself"):
        load_mesh(write_3mf(tmp_path / "i.3mf", {**files, "3D/3dmodel.model": itself}))


def test_a_part_a_few_layers_high_is_likely_in_inches():
    small = Mesh("shaft", BOX.vertices * 6.7 / 30, BOX.faces)
    (line,) = low_part_warnings(small, "mm", 1.73)
    assert line.code == Code.MESH_UNITS
    assert "units: inch would make it 170.2 mm" in line
    assert low_part_warnings(Mesh("x", BOX.vertices, BOX.faces), "mm", 1.73) == []
    assert low_part_warnings(small, "m", 1.73) == []


def test_far_from_the_origin_nothing_is_lost(tmp_path):
    points, polygons = prism(U, 3, 5.0)
    mesh = load_mesh(write_polygons(tmp_path / "far.obj", points + np.array([1e6, -2e6, 3e6]), polygons))
    assert (mesh.volume, mesh.warnings) == (pytest.approx(5 * U_MM2), ())


def test_a_header_alone_is_no_part(tmp_path):
    (tmp_path / "x.stl").write_bytes(bytes(84))
    assert len(read_stl(tmp_path / "x.stl").faces) == 0
    with pytest.raises(PartError, match="no triangles in the file"):
        load_mesh(tmp_path / "x.stl")


@pytest.mark.skipif(importlib.util.find_spec("rtbdata") is None, reason="needs the meshes of the package rtbdata")
@pytest.mark.parametrize("name", ["UNIMATE/puma560/link4.stl", "KUKA/KR5_arc/link6.stl", "ABB/IRB140/link6.stl"])
def test_public_meshes_hold_what_trimesh_says(name):
    root = importlib.util.find_spec("rtbdata").submodule_search_locations[0]
    file = Path(root) / "meshes" / name
    theirs = trimesh.load(file, force="mesh")
    if not theirs.is_watertight:
        with pytest.raises(PartError, match="not closed"):
            load_mesh(file, "m")
        return
    assert load_mesh(file, "m").volume == pytest.approx(1e9 * theirs.volume, rel=1e-6)
