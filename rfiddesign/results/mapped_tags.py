"""A tag map that was learned, as a file for a spreadsheet."""

from rfiddesign.floor.mapped_tags import MappedTags

HEADER = "tag,x_mm,y_mm,var_x_mm2,cov_xy_mm2,var_y_mm2,n_reads"


def mapped_tags_csv(tags: MappedTags) -> str:
    """One line for each tag: its place to 0.1 mm, the covariance of that, and how often it was read.

    All cells below the header are numbers, so that none can be taken for a formula.
    """
    lines = [HEADER]
    for tag, (x, y), covariance, n_reads in zip(
        tags.tag_id.tolist(), tags.mean_mm.tolist(), tags.covariance_mm2.tolist(), tags.n_reads.tolist(), strict=True
    ):
        (xx, xy), (_, yy) = covariance
        lines.append(f"{int(tag)},{x:.1f},{y:.1f},{xx:.2f},{xy:.2f},{yy:.2f},{int(n_reads)}")
    return "\n".join(lines) + "\n"
