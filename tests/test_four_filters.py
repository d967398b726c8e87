"""The command that prints the table of four filters."""

import four_filters


def test_the_table_has_a_line_for_each_filter(capsys):
    """Four filters, and none that claims four times what it may after three runs."""
    four_filters.main(["--runs", "3", "--seed", "1"])
    header, _, *lines = capsys.readouterr().out.splitlines()
    assert header.split("|")[1].strip() == "filter"
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert [row[0] for row in rows] == ["EKF", "UKF", "PF", "InEKF"]
    assert all(0.0 < float(row[3]) < 12.0 for row in rows)
