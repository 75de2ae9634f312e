"""The paper's numbers, as they are typed in."""

from pipeline.report import paper


def test_every_number_stands_in_a_table() -> None:
    """What is typed but in no table would never be compared."""
    shown = {*paper.BENCHMARK, *paper.OPTIMISERS, *paper.ABLATIONS}
    assert shown == {method for _, method in paper.LANDING}
    assert {band for band, _ in paper.LANDING} == {"band1", "band2", "band3"}


def test_the_papers_rows_average_to_what_it_prints() -> None:
    """One row does not, and the report says so."""
    for (_, method), (*targets, total) in paper.LANDING.items():
        if total:
            mean = sum(cell[0] for cell in targets) / 3
            exception = method == "no_covariance_no_multistart"
            assert (abs(mean - total[0]) > 0.01) == exception
