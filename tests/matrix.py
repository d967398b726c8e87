"""What the kill matrix of a stage must look like."""

import kill_matrix


def hold_matrix(
    expected: dict[str, tuple[set[int], float]], correct: set[str], name: str, secrets: list[str]
) -> None:
    """Assert that every wrong version fails just its checks and is named, and every correct one passes.

    Parameters
    ----------
    expected : dict of str to tuple of (set of int, float)
        For each wrong version the checks it fails, by number, and its share of the points in twentieths.
    correct : set of str
        The correct versions beside the reference.
    name : str
        The stage.
    secrets : list of str
        The course secrets to try.
    """
    rows = list(kill_matrix.rows(kill_matrix.stages()[name], secrets))
    wrong = {row.name: row for row in rows if row.wrong}
    assert set(wrong) == set(expected)
    assert {row.name for row in rows if not row.wrong} == correct | {"reference"}
    assert [row.name for row in rows if not row.holds] == []
    for title, (numbers, twentieths) in expected.items():
        assert {i for i, count in enumerate(wrong[title].failures, start=1) if count} == numbers, title
        assert set(wrong[title].failures) <= {0, len(secrets)}, title
        assert [round(20 * share, 9) for share in wrong[title].shares] == [twentieths], title
