"""Notebooks and repositories made for a test."""

import json
import subprocess


def notebook(*sources):
    """Return the bytes of a notebook with these code cells."""
    cells = [
        {
            "cell_type": "code",
            "metadata": {},
            "execution_count": None,
            "outputs": [],
            "source": source.splitlines(True),
        }
        for source in sources
    ]
    return json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}).encode()


def git(folder, *arguments):
    """Run git with a name of its own, whatever the machine's settings are."""
    names = ["-c", "user.name=Test", "-c", "user.email=test@example.org"]
    done = subprocess.run(["git", *names, *arguments], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout
