import ast
import html
import sys

import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output

from roboloc.checks import STAGES, check, motion
from roboloc.checks.report import Check
from roboloc_reference import gaussian
from roboloc_reference.motion import compute_dynamics as reference_dynamics


def naive(xvec, u, dt, eps):
    """Write the textbook formula with a switch to the limits below eps."""
    x, y, theta = xvec
    V, omega = u
    end = theta + omega * dt
    if abs(omega) < eps:
        s, c = np.sin(theta), np.cos(theta)
        g = np.array([x + V * dt * c, y + V * dt * s, end])
        Gx = np.array([[1, 0, -V * dt * s], [0, 1, V * dt * c], [0, 0, 1]])
        Gu = np.array([[dt * c, -V * dt**2 * s / 2], [dt * s, V * dt**2 * c / 2], [0, dt]])
        return g, Gx, Gu
    ds, dc = np.sin(end) - np.sin(theta), np.cos(end) - np.cos(theta)
    g = np.array([x + V / omega * ds, y - V / omega * dc, end])
    Gx = np.array([[1, 0, V / omega * dc], [0, 1, V / omega * ds], [0, 0, 1]])
    by_omega = [V / omega * (dt * np.cos(end) - ds / omega), V / omega * (dt * np.sin(end) + dc / omega)]
    return g, Gx, np.array([[ds / omega, by_omega[0]], [-dc / omega, by_omega[1]], [0, dt]])


def handout(xvec, u, dt):
    """Switch where the handout does: a correct alternative."""
    return naive(xvec, u, dt, 1e-3)


def complex_numbers(xvec, u, dt):
    """Write the plane as complex numbers and differentiate a power series: a correct alternative."""
    a = 1j * u[1] * dt
    terms = np.cumprod([1.0 + 0j] + [a / k for k in range(2, 80)])  # a^k / (k + 1)!
    powers = np.cumprod([0.5 + 0j] + [a * (k + 1) / (k * (k + 2)) for k in range(1, 79)])  # derivative
    way = dt * np.exp(1j * xvec[2]) * terms.sum()
    turn = u[0] * dt * np.exp(1j * xvec[2]) * powers.sum() * 1j * dt
    z = u[0] * way
    g = np.array([xvec[0] + z.real, xvec[1] + z.imag, xvec[2] + u[1] * dt])
    Gx = np.array([[1, 0, -z.imag], [0, 1, z.real], [0, 0, 1]])
    return g, Gx, np.array([[way.real, turn.real], [way.imag, turn.imag], [0, dt]])


def wrapping(xvec, u, dt):
    """Wrap the heading: unusual, not wrong."""
    g, Gx, Gu = handout(xvec, u, dt)
    return [[g[0], g[1], (g[2] + np.pi) % (2 * np.pi) - np.pi], Gx.tolist(), Gu.tolist()]


@pytest.mark.parametrize("function", [reference_dynamics, handout, complex_numbers, wrapping])
def test_correct_dynamics_pass(function):
    """The public check accepts every correct way, the handout's switch and a wrapped heading included."""
    report = check(function, stage="compute_dynamics")
    assert report, str(report)


def euler(xvec, u, dt):
    """Go straight for the whole step."""
    g, Gx, Gu = naive(xvec, (u[0], 0.0), dt, 1.0)
    return g + np.array([0, 0, u[1] * dt]), Gx, Gu * [[1, 0], [1, 0], [1, 1]]


def transposed(xvec, u, dt):
    """Return Gx transposed."""
    g, Gx, Gu = handout(xvec, u, dt)
    return g, Gx.T, Gu


def degrees(xvec, u, dt):
    """Take the heading in degrees."""
    g, Gx, Gu = handout((xvec[0], xvec[1], np.radians(xvec[2])), u, dt)
    return g, Gx, Gu


def zeroed(xvec, u, dt):
    """Forget the derivative by omega where omega is small."""
    g, Gx, Gu = handout(xvec, u, dt)
    return g, Gx, Gu * [[1, 0], [1, 0], [1, 1]] if abs(u[1]) < 1e-3 else Gu


def frozen(xvec, u, dt):
    """Keep the heading where omega is small."""
    g, Gx, Gu = handout(xvec, u, dt)
    return np.array([g[0], g[1], xvec[2]]) if abs(u[1]) < 1e-3 else g, Gx, Gu


def never_switched(xvec, u, dt):
    """Use the limits at omega = 0 only and lose the digits next to it."""
    return naive(xvec, u, dt, 1e-300)


def product_rule(xvec, u, dt):
    """Differentiate V / omega by omega and leave the sines alone (ERRATA R1)."""
    g, Gx, Gu = handout(xvec, u, dt)
    if abs(u[1]) >= 1e-3:
        Gu[:2, 1] = -(g - xvec)[:2] / u[1]
    return g, Gx, Gu


def unit_time(xvec, u, dt):
    """Leave dt out."""
    return handout(xvec, u, 1.0)


def in_place(xvec, u, dt):
    """Move the pose where it is."""
    g, Gx, Gu = handout(xvec, u, dt)
    xvec[:] = g
    return xvec, Gx, Gu


@pytest.mark.parametrize(
    ("function", "finding"),
    [
        (euler, "drives a quarter circle to the left"),
        (transposed, "Gx agrees with small changes of the pose"),
        (degrees, "drives where it faces"),
        (zeroed, "Gu agrees with small changes of the control at omega = 0"),
        (frozen, "the heading turns however small omega is"),
        (never_switched, "Gu approaches its value at omega = 0 from both sides"),
        (product_rule, "Gu agrees with small changes of the control"),
        (unit_time, "drives straight ahead"),
        (in_place, "leaves its arguments as they were"),
    ],
)
def test_wrong_dynamics_are_told_what_is_wrong(function, finding):
    """Each mistake is found by the check that is about it, and says more than yes or no."""
    report = check(function, stage="compute_dynamics")
    found = {item.name: item for item in report.items if not item.passed}
    assert not report
    assert found[finding].message


def test_each_check_of_the_dynamics_can_fail():
    """No line of the report is right by default: a wrong Gx fails the checks of Gx and no other."""

    def wrong_limit(xvec, u, dt):
        g, Gx, Gu = handout(xvec, u, dt)
        return g + np.array([0.01, 0, 0]) * (u[1] == 0), Gx + 0.1 * (u[1] == 0) * np.eye(3), Gu

    names = {item.name for item in check(wrong_limit, stage="compute_dynamics").items if not item.passed}
    assert "g approaches its value at omega = 0 from both sides" in names
    assert "Gx approaches its value at omega = 0 from both sides" in names
    assert "Gu agrees with small changes of the control" not in names

    def jumpy(xvec, u, dt):
        g, Gx, Gu = handout(xvec, u, dt)
        return g + np.array([dt * dt, 0, 0]), Gx, Gu

    names = {item.name for item in check(jumpy, stage="compute_dynamics").items if not item.passed}
    assert "two half steps make one step" in names
    assert "turns on the spot" in names


GAUSSIAN_MISTAKES = {
    "Gx transposed": (
        lambda g, Gx, Gu, S, R, dt: (g, Gx.T @ S @ Gx + dt * Gu @ R @ Gu.T),
        "doubtful heading",
    ),
    "dt missing": (lambda g, Gx, Gu, S, R, _: (g, Gx @ S @ Gx.T + Gu @ R @ Gu.T), "noise grows with dt"),
    "dt squared": (lambda g, Gx, Gu, S, R, dt: (g, Gx @ S @ Gx.T + dt**2 * Gu @ R @ Gu.T), "noise grows"),
    "R squared": (
        lambda g, Gx, Gu, S, R, dt: (g, Gx @ S @ Gx.T + dt * Gu @ R @ R @ Gu.T),
        "doubtful control",
    ),
    "R diagonal": (
        lambda g, Gx, Gu, S, R, dt: (g, Gx @ S @ Gx.T + dt * Gu @ np.diag(np.diag(R)) @ Gu.T),
        "everything at once",
    ),
    "no transpose": (lambda g, Gx, Gu, S, R, dt: (g, Gx @ S @ Gx + dt * Gu @ R @ Gu.T), "symmetric"),
    "mean moved twice": (
        lambda g, Gx, Gu, S, R, dt: (Gx @ g, Gx @ S @ Gx.T + dt * Gu @ R @ Gu.T),
        "mean is g",
    ),
    "noise taken away": (lambda g, Gx, Gu, S, R, dt: (g, Gx @ S @ Gx.T - dt * Gu @ R @ Gu.T), "variance"),
    "three by three only": (
        lambda g, Gx, Gu, S, R, dt: (g, (Gx @ S @ Gx.T + dt * Gu @ R @ Gu.T)[:3, :3]),
        "states of any size",
    ),
}


@pytest.mark.parametrize("mistake", GAUSSIAN_MISTAKES)
def test_wrong_predictions_are_told_what_is_wrong(mistake):
    """Each mistake is found by the check that is about it."""
    function, finding = GAUSSIAN_MISTAKES[mistake]
    report = check(function, stage="transition_update")
    assert any(finding in item.name for item in report.items if not item.passed), str(report)


def test_a_prediction_in_place_is_found():
    """Sigma += ... writes to the caller's covariance."""

    def in_place(g, Gx, Gu, Sigma, R, dt):
        Sigma[:] = Gx @ Sigma @ Gx.T + dt * Gu @ R @ Gu.T
        return g, Sigma

    (item,) = [item for item in check(in_place, stage="transition_update").items if not item.passed]
    assert "argument Sigma" in item.message


def test_a_correct_prediction_passes_under_its_own_name():
    """The stage is found by the function's name."""
    report = check(gaussian.transition_update)
    assert report, str(report)
    assert report.stage == "transition_update"


def unwritten(*arguments):
    """Stand for a released cell."""
    raise NotImplementedError


def divides(*arguments):
    """Raise something."""
    return 1 / 0


class Refuses:
    """An object that raises whatever is asked of it."""

    def __array__(self, *arguments, **keywords):
        raise RuntimeError


def results(value, count):
    """Return a value as so many results: one comes by itself."""
    return (value,) * count if count > 1 else value


def results_of(stage):
    """Read off the reports how many results a stage has, and the shape of the first where it is called first."""
    first = check(lambda *_: 7, stage=stage).items[0].message
    count = int(first.split()[1]) if first.startswith("Expected") else 1
    message = check(lambda *_: results(np.zeros((9, 9)), count), stage=stage).items[0].message
    return count, ast.literal_eval(message.partition("shape ")[2].partition(", but")[0])


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize(
    ("function", "message"),
    [
        (unwritten, "not written yet"),
        (divides, "ZeroDivisionError: division by zero"),
        (lambda *_: sys.exit(), "SystemExit"),
        (lambda *_: None, "returns None"),
        (lambda *_: 7, "got int"),
        (lambda *_: (), "got 0 values"),
        (lambda: None, "TypeError"),
    ],
)
def test_no_function_makes_the_check_fail_itself(stage, function, message):
    """Whatever a function does, the report says so in its first line and the rest is skipped."""
    report = check(function, stage=stage)
    assert not report
    if message == "got int" and report.items[0].passed:
        return  # a number is what this stage returns
    if message.startswith("got") and results_of(stage)[0] == 1:
        message = "should have shape"
    assert message in report.items[0].message
    assert all(item.passed is None for item in report.items[1:])


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda _: None, "is None"),
        (lambda _: "a", "real numbers"),
        (lambda _: Refuses(), "Refuses"),
        (lambda _: [[1], [1, 2]], "not an array"),
        (lambda _: np.eye(4), "shape (4, 4)"),
        (lambda shape: np.full(shape, np.nan), "not finite"),
        (lambda shape: np.ones(shape, dtype=complex), "complex"),
    ],
)
def test_no_result_makes_the_check_fail_itself(stage, make, message):
    """Whatever a function returns, the report says what is wrong with it in its first line."""
    count, shape = results_of(stage)
    report = check(lambda *_: results(make(shape), count), stage=stage)
    if message == "is None" and count == 1:
        message = "returns None"
    assert not report
    assert message in report.items[0].message
    assert all(item.passed is None for item in report.items[1:])


@pytest.mark.parametrize("thing", [None, 3, "compute_dynamics", np.zeros(3)])
def test_what_is_no_function_is_told_so(thing):
    """Something that cannot be called gets a report, not an exception."""
    report = check(thing)
    assert not report
    assert "Expected a function" in report.items[0].message


@pytest.mark.parametrize("arguments", [(lambda: 0,), (np.sin,), (unwritten, "compute"), (unwritten, 3)])
def test_an_unknown_stage_is_told_which_there_are(arguments):
    """The report names the stages that have a public check."""
    report = check(*arguments)
    assert not report
    assert "motion.compute_dynamics, gaussian.transition_update" in report.items[0].message


def test_a_stage_of_two_problems_is_found_by_its_full_name(monkeypatch):
    """The name alone means the first problem's."""
    other = (Check("is the other one", lambda _: None),)
    monkeypatch.setitem(STAGES, "slam.compute_dynamics", other)
    assert [item.name for item in check(unwritten, "slam.compute_dynamics").items] == ["is the other one"]
    for name in ("compute_dynamics", "motion.compute_dynamics"):
        assert "not written yet" in check(unwritten, name).items[0].message


def test_prints_of_the_function_are_not_shown(capsys, monkeypatch):
    """Hundreds of calls do not bury the report in a student's debugging output."""

    def chatty(xvec, u, dt):
        sys.stdout.write("debugging")
        return handout(xvec, u, dt)

    monkeypatch.setattr("IPython.get_ipython", lambda: None)  # other tests of this process may run a shell
    check(chatty, stage="compute_dynamics")
    out = capsys.readouterr().out
    assert "debugging" not in out
    assert out.startswith("compute_dynamics: 16 of 16 right")


def test_warnings_of_the_function_are_not_errors():
    """NumPy's 0 / 0 reaches the student as a number that is not finite."""

    def divide(xvec, u, dt):
        g, Gx, Gu = handout(xvec, u, dt)
        return g * (u[1] / u[1]), Gx, Gu

    report = check(divide, stage="compute_dynamics")
    assert "not finite in g" in {item.name: item.message for item in report.items}["drives straight ahead"]


def test_a_check_repeats_itself():
    """The report of a function is the same every time."""
    assert check(euler, stage="compute_dynamics") == check(euler, stage="compute_dynamics")


def test_the_report_reads_well_as_text_and_as_html():
    """Text and HTML say the same, and what comes from the student is escaped."""

    def bad(xvec, u, dt):
        raise ValueError("<b>no</b>")

    report = check(bad, stage="compute_dynamics")
    assert "raises ValueError: <b>no</b>" in str(report)
    page = report._repr_html_()
    assert "<b>no</b>" not in page
    assert html.escape("<b>no</b>") in page
    assert all(html.escape(item.name) in page for item in report.items)
    assert repr(report) == "<Report compute_dynamics: 0 of 16 right>"


def test_jupyter_shows_the_report_once_and_again_when_asked():
    """In a cell that ends with check(...) there is one output; naming the report later shows it anew."""
    shell = InteractiveShell.instance()
    try:
        shell.user_ns.update(check=check, f=handout)
        outputs = []
        for cell in (
            "report = check(f, 'compute_dynamics')\nreport",
            "report",
            "check(f, 'compute_dynamics');",
        ):
            with capture_output() as captured:
                shell.run_cell(cell, store_history=True).raise_error()
            outputs.append(captured.outputs)
        assert [len(output) for output in outputs] == [1, 1, 1]
        assert all("16 of 16 right" in output[0].data["text/html"] for output in outputs)
        assert "16 of 16 right" in outputs[0][0].data["text/plain"]
    finally:
        InteractiveShell.clear_instance()


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    source = motion.__loader__.get_source(motion.__name__)
    assert "cos(" not in source
    assert "sin(" not in source
