"""Questions of the validation, and the modules that list problems with known answers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from . import drops, errors, features, nonsmooth, pendulum, published, saved, solvers, stability
from .known import Known

QUESTIONS = {
    "published": "Do published problems and equations of motion come out?",
    "stability": "Do stability and frequencies come out?",
    "restitution": "Do contact laws deliver the restitution that they promise?",
    "nonsmooth": "Does smooth contact come to nonsmooth trajectories as it stiffens?",
    "solvers": "Do two solvers agree that share no equation?",
    "errors": "Is the error that a run reports the true one?",
    "features": "Are narrow features of a user's function seen?",
    "random": "Is any random mechanism silently wrong?",
}
"""Titles of questions, by their key in the comments of docs/validation.md."""
MODULES = (published, stability, drops, nonsmooth, pendulum, solvers, errors, features, saved)


def list_known(question: str = "") -> Iterator[Known]:
    """Yield the problems of one question, or all."""
    return (known for known in chain.from_iterable(module.list_known() for module in MODULES) if question in ("", known.question))
