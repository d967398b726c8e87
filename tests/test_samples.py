"""The sample class: its table is whole, its students hand in what their files say."""

import ast
import functools
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest

import course
import course_results
import notebooks
import sample_class
from autograder.check import Recorder, copied, run_stage
from autograder.checks import STAGES
from autograder.misconceptions import MISCONCEPTIONS

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = sorted(folder for folder in (ROOT / "samples").glob("*/*") if folder.is_dir())
MOTION = ROOT / "samples" / "ekf-localization" / "motion-model"
PLACES = {"repository": "/repository", "course": "/course", "port": "1"}


Sample = sample_class.Sample


def release(folder):
    """Return the released notebook that a folder of samples belongs to."""
    return nbformat.read(ROOT / "notebooks" / folder.parent.name / f"{folder.name}.ipynb", as_version=4)


@functools.cache
def source(folder):
    """Return the source of the notebook that a folder of samples belongs to."""
    path = ROOT / "solutions" / folder.parent.name / f"{folder.name}.md"
    return notebooks.name_cells(notebooks.splice(notebooks.read(path), ROOT))


@functools.cache
def cells(folder):
    """Return the cells of the graded functions of a folder's notebook by stage."""
    return sample_class.stage_cells(source(folder))


@functools.cache
def class_of(folder):
    """Return the samples of a folder's notebook by name."""
    return {sample.name: sample for sample in sample_class.sample_class(folder, cells(folder))}


def given(folder):
    """Return the code cells of a folder's notebook that only import something, and its given functions."""
    found = []
    for cell in source(folder).cells:
        meta = cell.metadata.get("nbgrader", {})
        helper = meta.get("locked") and not meta["grade_id"].startswith("derive")
        if cell.cell_type == "code" and (
            re.fullmatch(r"((import|from) .*\n?|\n)+", cell.source)
            or (helper and cell.source.startswith("def "))
        ):
            found.append(cell.source)
    return found


@functools.cache
def titles(folder):
    """Return the names of the mistakes that can be made in a folder's notebook, by name."""
    text = "".join(cell.source for cell in source(folder).cells)
    return {item.name: item for item in MISCONCEPTIONS if f'"{item.stage}"' in text}


@pytest.fixture
def answers():
    """Return the right answers of the motion-model notebook by cell."""
    return sample_class.solutions(source(MOTION))


@pytest.fixture(scope="module")
def released():
    """Return the released motion-model notebook."""
    return release(MOTION)


def hand_in(sample, released, answers):
    """Return the notebook that a sample hands in."""
    data = sample_class.hand_in(sample, released, answers, PLACES)
    return nbformat.reads(data.decode(), as_version=4)


def grade_ids(notebook):
    """Return the grade ids of a notebook in order."""
    return [c.metadata.nbgrader["grade_id"] for c in notebook.cells if "nbgrader" in c.metadata]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_table_lists_every_student_and_every_grade_cell(folder):
    """The table of a notebook has a line for each student and a column for each cell that has points or is marked."""
    expected = course_results.read_expected(folder / "expected.csv")
    assert sorted(expected) == list(class_of(folder))
    graded = [c for c in source(folder).cells if (m := c.metadata.get("nbgrader")) and (m.grade or m.task)]
    most = {cell.metadata.nbgrader["grade_id"]: most_of(cell) for cell in graded}
    for name, result in expected.items():
        assert result.scores.keys() == most.keys(), name
        for cell, score in result.scores.items():
            assert score == course_results.MANUAL or 0 <= float(score) <= most[cell], (name, cell)


def most_of(cell):
    """Return the most that a graded cell can give: its points, or its extra credit."""
    (extra,) = re.findall(r"^grade_vectorised\(.*, extra=(\d+)\)", cell.source, re.MULTILINE) or [0]
    return cell.metadata.nbgrader["points"] + int(extra)


def diagnoses(folder):
    """Return the mistakes that the table lists for each ``mistake-`` student."""
    expected = course_results.read_expected(folder / "expected.csv")
    return {
        name: result.diagnosis.split("; ") for name, result in expected.items() if name.startswith("mistake-")
    }


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_misconception_has_a_student(folder):
    """Each wrong version that the grader knows is the expected diagnosis of exactly one student beside others'."""
    listed = [title for titles in diagnoses(folder).values() for title in titles]
    assert sorted(listed) == sorted(titles(folder))


def test_every_misconception_belongs_to_a_notebook():
    """No wrong version is without a notebook whose samples make the mistake."""
    assert {name for folder in FOLDERS for name in titles(folder)} == {item.name for item in MISCONCEPTIONS}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_misconception_is_handed_in(folder):
    """The mistakes that the table lists are those in the student's cells, and there is no other wrong cell."""
    texts = [sample_class.read_sample(path) for path in folder.glob("mistake-*.md")]
    known = titles(folder)
    for name, listed in diagnoses(folder).items():
        wrong = {
            cells(folder)[item.stage]: sample_class.student_source(item)
            for title in listed
            if (item := known[title]).stage in cells(folder)
        }
        symbolic = [title for title in listed if known[title].stage not in cells(folder)]
        files = [sample for sample in texts if sample.student == name]
        assert len(symbolic) == len(files), name
        for sample in files:
            slug = sample.name.removeprefix("mistake-")
            assert any(re.sub(r"[^a-z0-9]+", "-", title.lower()).startswith(slug) for title in symbolic), name
            wrong |= sample.cells
        assert class_of(folder)[name].cells == wrong
    assert {sample.student for sample in texts} <= diagnoses(folder).keys()


def test_samples_are_dealt_to_students():
    """A student has one sample of each notebook, of the own name or kind; what is left over is a student's own."""
    one = [Sample(name, "") for name in ("alternative-a", "blank", "mistake-a", "mistake-b", "odd")]
    two = [Sample(name, "") for name in ("blank", "mistake-c", "mistake-d", "perfect")]
    dealt = sample_class.deal({"two": two, "one": one})
    assert {who: {name: sample.name for name, sample in has.items()} for who, has in dealt.items()} == {
        "alternative-a": {"one": "alternative-a"},
        "blank": {"one": "blank", "two": "blank"},
        "mistake-a": {"one": "mistake-a", "two": "mistake-c"},
        "mistake-b": {"one": "mistake-b", "two": "mistake-d"},
        "odd": {"one": "odd"},
        "perfect": {"two": "perfect"},
    }


@pytest.mark.parametrize("assignment", sorted({folder.parent.name for folder in FOLDERS}))
def test_each_class_has_students_of_every_kind(assignment):
    """Without every mistake a class still has the perfect, another right, a blank, a hostile one and three mistakes."""
    sources = {folder.name: source(folder) for folder in FOLDERS if folder.parent.name == assignment}
    names = {
        sample.name
        for handed_in in course.students(assignment, sources, every_mistake=False).values()
        for sample in handed_in.values()
    }
    assert {"perfect", "blank", "imports-the-reference"} <= names
    assert any(name.startswith("alternative-") for name in names)
    assert sum(name.startswith("mistake-") for name in names) >= 3


def test_cells_of_stages_are_read_off_the_test_cells():
    """Each graded function has the cell in which the student writes it."""
    assert cells(MOTION) == {
        "motion.compute_dynamics": "dynamics", "gaussian.transition_update": "transition",
    }  # fmt: skip


def test_a_cell_has_one_writer_who_is_in_the_class(tmp_path):
    """Cells for a student whom there is not, or who writes them already, are refused, and so are options with them."""
    path = tmp_path / "more.md"
    cell = "# More\n\nText.\n\n```{cell} dynamics\npass\n```\n"
    path.write_text(f"---\nstudent: nobody\n---\n{cell}")
    with pytest.raises(ValueError, match="more: expected a student of the class, got nobody"):
        sample_class.sample_class(tmp_path, cells(MOTION))
    path.write_text(f"---\nstudent: mistake-euler-step\n---\n{cell}")
    with pytest.raises(
        ValueError, match="mistake-euler-step: expected one answer to dynamics, got more's as"
    ):
        sample_class.sample_class(tmp_path, cells(MOTION))
    path.write_text(f"---\nstudent: mistake-euler-step\nrest: release\n---\n{cell}")
    with pytest.raises(ValueError, match=r"more\.md: expected no option beside student"):
        sample_class.sample_class(tmp_path, cells(MOTION))


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_who_loses_points_and_who_does_not(folder):
    """Right ways of writing get everything, mistakes cost something, and students who attack earn nothing by it."""
    expected = course_results.read_expected(folder / "expected.csv")
    totals = {
        name: sum(float(score) for score in result.scores.values() if score != course_results.MANUAL)
        for name, result in expected.items()
    }
    tests = [
        c for c in source(folder).cells if (m := c.metadata.get("nbgrader")) and m.grade and not m.solution
    ]
    points, full = sum(c.metadata.nbgrader.points for c in tests), sum(map(most_of, tests))
    assert totals["perfect"] == full > 0
    assert totals["blank"] == 0
    for name, total in totals.items():
        if name.startswith("alternative-"):
            assert points <= total <= full, name
        if name.startswith("mistake-"):
            assert 0 < total < full, name
    attacks = [sample.name for sample in class_of(folder).values() if sample.rest == "release"]
    assert len(attacks) > (8 if folder == MOTION else 0)
    assert {totals[name] for name in attacks} == {0}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_sample_can_be_handed_in(folder):
    """Every student's file can be made, is Python where it is a notebook, and has no place left open."""
    released = release(folder)
    before, answers = nbformat.writes(released), sample_class.solutions(source(folder))
    for sample in class_of(folder).values():
        data = sample_class.hand_in(sample, released, answers, PLACES)
        if sample.file != "notebook":
            assert (data is None) == (sample.file == "none")
            continue
        notebook = nbformat.reads(data.decode(), as_version=4)
        for name in sample.cells:
            (cell,) = (c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == name)
            assert not re.search(r"@\w+@", cell.source), sample.name
            if cell.cell_type == "code":
                ast.parse(cell.source)
    assert nbformat.writes(released) == before


@functools.cache
def calls(stage):
    """Return the arguments of the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "a course")
    return [call.args for call in recorder.calls]


def parts(returned):
    """Return what a call returned one by one; samples are one thing."""
    return returned if isinstance(returned, tuple) else (returned,)


@pytest.mark.parametrize(
    ("folder", "item"),
    [(f, i) for f in FOLDERS for i in MISCONCEPTIONS if i.stage in cells(f)],
    ids=lambda value: getattr(value, "name", None),
)
def test_a_mistake_in_a_cell_is_the_mistake_of_the_catalogue(folder, item):
    """What a student's cell computes is what the wrong version computes, up to the limits that the handout allows."""
    stage = STAGES[item.stage]
    sample, answers = sample_class.mistake(item, cells(folder)), sample_class.solutions(source(folder))
    ((name, text),) = sample.cells.items()
    namespace = {}
    for cell in [*given(folder), text.replace("@solution@", answers[name])]:
        exec(cell, namespace)  # noqa: S102 (our own)
    for args in calls(stage.name):
        if not item.determined(*args):
            continue
        ours, theirs = copied(args), copied(args)
        wanted, got = item.function(*ours), namespace[stage.function_name](*theirs)
        for one, other in zip([*parts(wanted), *ours], [*parts(got), *theirs], strict=True):
            if isinstance(one, np.random.Generator):
                continue
            if isinstance(one, dict):
                assert other == one
            else:
                np.testing.assert_allclose(other, one, rtol=1e-7, atol=3e-3)


def test_perfect_is_the_source_without_its_marks(answers, released):
    """The perfect student's cells are the source's answers, with no mark of the source left."""
    perfect = hand_in(Sample("perfect", "right"), released, answers)
    text = "".join(cell.source for cell in perfect.cells)
    assert "SOLUTION" not in text
    assert "NotImplementedError" not in text
    assert "YOUR ANSWER" not in text


def test_cells_can_be_deleted_renamed_and_be_there_twice(answers, released):
    """The options delete, duplicate and rename do what they say and nothing else."""
    names = grade_ids(released)
    changed = Sample(
        "odd",
        "odd",
        delete=("dynamics-test",),
        duplicate=("transition-test",),
        rename={"wheels-g-test": "mine"},
    )
    got = grade_ids(hand_in(changed, released, answers))
    i = names.index("transition-test")
    wanted = [*names[:i], "transition-test", *names[i:]]
    wanted.remove("dynamics-test")
    wanted[wanted.index("wheels-g-test")] = "mine"
    assert got == wanted


def test_a_sample_that_names_an_unknown_cell_is_refused(answers, released):
    """A cell that the release does not have is a mistake of the sample's."""
    for sample in (
        Sample("odd", "odd", cells={"dynamic": "1"}),
        Sample("odd", "odd", delete=("dynamic",)),
    ):
        with pytest.raises(ValueError, match="odd: expected cells of the release, got dynamic"):
            sample_class.hand_in(sample, released, answers, PLACES)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nothing", "expected a heading and what the student does"),
        ("# title\n\n```{cell} dynamics\npass\n```\n", "expected a heading and what the student does"),
        ("---\nrests: 1\n---\n# title\n\nText.\n", r"expected options .*, got \['rests'\]"),
    ],
)
def test_a_sample_that_says_too_little_is_refused(text, words, tmp_path):
    """A sample without heading or sentence, or with an unknown option, is a mistake."""
    path = tmp_path / "odd.md"
    path.write_text(text)
    with pytest.raises(ValueError, match=words):
        sample_class.read_sample(path)


def test_a_sample_is_read_as_it_is_written(tmp_path):
    """Options, sentence and cells are read; a cell may come from a file of the repository."""
    path = tmp_path / "odd.md"
    cell = "```{cell} dynamics from tests/autograder/alternatives/motion_model/series.py\n```\n"
    path.write_text(
        f"---\nrest: release\ndelete: [a]\n---\n# Odd\n\nWhat\nit does.\n\n```{{cell}} b\nx = 1\n```\n\n{cell}"
    )
    sample = sample_class.read_sample(path)
    assert (sample.name, sample.about, sample.rest, sample.delete) == (
        "odd",
        "What it does.",
        "release",
        ("a",),
    )
    assert sample.cells["b"] == "x = 1"
    assert "power series" in sample.cells["dynamics"]
