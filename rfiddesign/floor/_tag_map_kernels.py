"""Tags into the cells of a grid, compiled; the readable caller is in tag_map.py."""

from rfiddesign.numerics._compile_kernels import leaf_kernel


@leaf_kernel
def cell_of(x, y, low_x, low_y, cell_mm, n_x):
    """Number of the cell of one point, taken in double precision."""
    return int((y - low_y) / cell_mm) * n_x + int((x - low_x) / cell_mm)


@leaf_kernel
def sort_into_cells(points, low_x, low_y, cell_mm, n_x, cell_start, order):
    """Counting sort of `points` (n, 2) by cell, within a cell by number.

    Fills `cell_start` (n_cells + 1,), zeros before, and `order` (n,), the number of the point in each slot.
    """
    n_points, n_cells = points.shape[0], cell_start.shape[0] - 1
    for k in range(n_points):
        cell_start[cell_of(points[k, 0], points[k, 1], low_x, low_y, cell_mm, n_x) + 1] += 1
    for cell in range(n_cells):
        cell_start[cell + 1] += cell_start[cell]
    # Backward, each cell filled from its end: then the ends are the starts.
    for k in range(n_points - 1, -1, -1):
        cell = cell_of(points[k, 0], points[k, 1], low_x, low_y, cell_mm, n_x)
        cell_start[cell + 1] -= 1
        order[cell_start[cell + 1]] = k
    for cell in range(n_cells):
        cell_start[cell] = cell_start[cell + 1]
    cell_start[n_cells] = n_points
