"""The half of `frep.io.vdb` that talks to OpenVDB. It needs numpy and `openvdb` (or `pyopenvdb`), nothing of `frep`.

Another interpreter runs it as a script: `python _vdb_worker.py probe`, `... write grid.npz out.vdb`, `... read in.vdb
grid.npz`. It keeps to Python 3.8 and numpy 1, for that interpreter may be an old one.
"""

# pyright: reportMissingImports=false
import sys

if __name__ == "__main__":
    sys.path.pop(0)  # this folder; its modules must not be taken for others

import numpy as np

LEAF = 8
BRICK = 16 * LEAF
SHAPE_KEY = "frep_blocks"


def load_openvdb():
    """The OpenVDB module, whichever of its two names it has."""
    try:
        import openvdb
    except ImportError:
        import pyopenvdb as openvdb
    return openvdb


def probe():
    """Raise, or crash, where the module is missing or does not agree with this numpy."""
    grid = load_openvdb().FloatGrid()
    grid.copyFromArray(np.ones((LEAF, LEAF, LEAF), np.float32))


def write(path, name, origin, voxel, background, table, leaves, values):
    """Write one level set. `table` holds leaf numbers, -1 outside, -2 inside; see `SparseGrid`."""
    vdb = load_openvdb()
    far = np.float32(background)
    grid = vdb.FloatGrid(float(far))
    grid.name = name
    grid.gridClass = vdb.GridClass.LEVEL_SET
    grid.transform = vdb.createLinearTransform(float(voxel))
    grid.transform.translate(tuple(float(x) for x in origin))
    grid[SHAPE_KEY] = " ".join(str(n) for n in table.shape)

    table = table.copy()
    for number, block in enumerate(leaves):
        leaf = values[number]
        band = np.abs(leaf) < far
        if not band.any():
            table[tuple(block)] = -2 if leaf[0, 0, 0] < 0 else -1
            continue
        # The array call switches off exactly the voxels equal to the background; their sign is restored below.
        grid.copyFromArray(np.ascontiguousarray(np.where(band, leaf, far)), ijk=tuple(int(LEAF * b) for b in block))
    grid.signedFloodFill()

    # The flood goes by neighbours and cannot know a field that jumps across the band between two samples; correct it.
    for begin, end in runs(table, -2):
        grid.fill(begin, end, -float(far), active=False)
    for begin, end in runs(table, -1):
        grid.fill(begin, end, float(far), active=False)
    accessor = grid.getAccessor()
    found = np.empty((LEAF, LEAF, LEAF), np.float32)
    for number, block in enumerate(leaves):
        if table[tuple(block)] < 0:
            continue
        corner = LEAF * np.asarray(block)
        grid.copyToArray(found, ijk=tuple(int(c) for c in corner))
        wanted = np.clip(values[number], -far, far)
        for at in np.argwhere(found != wanted):
            accessor.setValueOff(tuple(int(c) for c in corner + at), float(wanted[tuple(at)]))
    grid.prune()
    vdb.write(path, grids=[grid])
    # OpenVDB says nothing about a full disk. Read the file again; the extremes touch every value.
    try:
        same = vdb.read(path, name).evalMinMax() == grid.evalMinMax()
    except Exception as error:
        raise OSError("the file came out incomplete; is the disk full? (" + str(error) + ")") from None
    if not same:
        raise OSError("the file came out incomplete; is the disk full?")


def runs(table, kind):
    """Boxes of samples (first, last), one for each run of blocks of a kind along the last axis."""
    is_kind = np.zeros((*table.shape[:2], table.shape[2] + 2), np.int8)
    is_kind[:, :, 1:-1] = table == kind
    step = np.diff(is_kind, axis=2)
    for first, last in zip(np.argwhere(step == 1), np.argwhere(step == -1)):  # noqa: B905
        begin = LEAF * first
        yield tuple(int(c) for c in begin), (int(begin[0]) + 7, int(begin[1]) + 7, int(LEAF * last[2]) - 1)


def read(path):
    """The first level set of a file as the arrays of a `SparseGrid`; ValueError where there is none that fits."""
    vdb = load_openvdb()
    names = [(type(grid).__name__, grid.gridClass, grid.name) for grid in vdb.readAllGridMetadata(path)]
    wanted = [name for kind, cls, name in names if kind == "FloatGrid" and cls == vdb.GridClass.LEVEL_SET]
    if not wanted:
        raise ValueError("it holds no float level set, only %s" % (names or "nothing"))
    grid = vdb.read(path, wanted[0])
    origin = np.array(grid.transform.indexToWorld((0, 0, 0)))
    axes = np.array([grid.transform.indexToWorld(tuple(row)) for row in np.eye(3)]) - origin
    voxel = float(axes[0, 0])
    if not voxel > 0 or not np.allclose(axes, voxel * np.eye(3), rtol=0, atol=1e-6 * abs(voxel)):
        raise ValueError("its voxels are not cubes along the axes")
    voxel = float(grid.transform.voxelSize()[0])
    far = np.float32(grid.background)

    low, high = (np.array(corner) for corner in grid.evalLeafBoundingBox())
    if SHAPE_KEY in grid.metadata:
        first = np.zeros(3, int)
        shape = np.array([int(n) for n in grid[SHAPE_KEY].split()])
    else:
        if not grid.leafCount():
            raise ValueError("its level set is empty")
        first = low // LEAF
        shape = high // LEAF + 1 - first
    table = np.full(shape, -1, np.int32)
    leaves, values = [], []
    n_brick = BRICK // LEAF
    dense = np.empty((BRICK,) * 3, np.float32)
    for corner in np.ndindex(*(-(-shape // n_brick))):
        block = n_brick * np.array(corner)
        grid.copyToArray(dense, ijk=tuple(int(c) for c in LEAF * (first + block)))
        bricks = dense.reshape(n_brick, LEAF, n_brick, LEAF, n_brick, LEAF).transpose(0, 2, 4, 1, 3, 5)
        bricks = bricks[tuple(slice(0, n) for n in shape - block)]
        band = (np.abs(bricks) < far).any(axis=(3, 4, 5))
        window = tuple(slice(b, b + n) for b, n in zip(block, band.shape))  # noqa: B905
        table[window] = np.where(bricks[..., 0, 0, 0] < 0, -2, -1)
        leaves.append(np.argwhere(band) + block)
        values.append(bricks[band])
    leaf_blocks = np.concatenate(leaves).astype(np.int32)
    order = np.lexsort(leaf_blocks.T[::-1])
    leaf_blocks = leaf_blocks[order]
    table[tuple(leaf_blocks.T)] = np.arange(len(leaf_blocks), dtype=np.int32)
    return {
        "origin": origin + voxel * LEAF * first,
        "voxel": voxel,
        "table": table,
        "leaves": leaf_blocks,
        "values": np.ascontiguousarray(np.concatenate(values)[order]),
        "background": float(far),
    }


def main(arguments):
    if arguments[0] == "probe":
        probe()
    elif arguments[0] == "write":
        with np.load(arguments[1]) as data:
            write(arguments[2], **{key: (data[key].item() if data[key].ndim == 0 else data[key]) for key in data.files})
    elif arguments[0] == "read":
        np.savez(arguments[2], **read(arguments[1]))


if __name__ == "__main__":
    main(sys.argv[1:])
