"""Scene: properties that follow from a mechanism, computed once for solvers, statics, checks and signals."""

from collections import Counter
from functools import cached_property
from math import pi, sqrt

import numpy as np

from ..elements import Link
from ..elements.clearance import Clearance
from ..elements.element import Burden, Element
from ..functions import step_ends
from ..geometry import Array
from ..mechanism import Mechanism
from .linkage import DEPENDENT, Linkage, independent_rows
from .remarks import remarks
from .start import Start, compute_jacobians, start


class Scene:
    """Mechanism with derived properties, each computed at first use and kept, as a mechanism never changes."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism

    @classmethod
    def of(cls, mechanism: Mechanism) -> "Scene":
        """Return the scene of a mechanism; the mechanism stores it."""
        if not hasattr(mechanism, "scene"):
            object.__setattr__(mechanism, "scene", cls(mechanism))
        found: Scene = mechanism.scene  # type: ignore[attr-defined]
        return found

    @cached_property
    def elements(self) -> dict[str, Element]:
        """All elements by their names."""
        return self.mechanism.elements()

    @cached_property
    def linkage(self) -> Linkage:
        """Linkage of the mechanism with every link rigid."""
        return Linkage(self.mechanism)

    @cached_property
    def burdens(self) -> list[Burden]:
        """Masses that elements add to bodies."""
        return [burden for each in self.elements.values() for burden in each.burdens(self.mechanism)]

    @cached_property
    def clearances(self) -> list[Clearance]:
        """Joints with clearance."""
        return [joint for joint in self.mechanism.joints if isinstance(joint, Clearance)]

    @cached_property
    def counts(self) -> Counter[str]:
        """Number of bodies of links and of other elements by the name of their class."""
        bodies = [link.body for link in self.mechanism.links]
        return Counter(type(each).__name__ for each in (*bodies, *self.elements.values()) if not isinstance(each, Link))

    @cached_property
    def start(self) -> Start:
        """Velocities at t = 0; raises a KinematicsError if drives and given velocities contradict the constraints."""
        return start(self.linkage)

    @cached_property
    def redundant(self) -> list[str]:
        """Elements whose rows depend on rows before them in a pose in general position; flexible links may deform."""
        names, matrix = self._constraints
        independent = independent_rows(matrix)
        return list(dict.fromkeys(name for k, name in enumerate(names) if k not in independent))

    @cached_property
    def undetermined(self) -> list[str]:
        """Elements whose forces no equation determines: their rows occur in a null vector of the transposed Jacobian."""
        names, matrix = self._constraints
        left, values, _ = np.linalg.svd(matrix)
        count = int((values > DEPENDENT * values.max(initial=1.0)).sum())  # of independent rows; relative to the largest, or 1
        shares = np.abs(left[:, count:]).max(axis=1, initial=0.0)  # largest component of the null vectors in each row
        # 1e-6: rounding changes components by up to 1e-16 over the least singular value above zero, at least DEPENDENT = 1e-9
        return list(dict.fromkeys(name for name, share in zip(names, shares, strict=True) if share > 1e-6))

    @cached_property
    def _constraints(self) -> tuple[list[str], Array]:
        """Elements and scaled derivatives, in general position, of the rows that hold throughout a run.

        Rows of drives come first: where a drive and a joint depend on each other, the joint is redundant. Columns are for places
        and angles (times the longest link) of links, and for deformations of flexible ones, whose scale does not affect the rank.
        """
        linkage = self.linkage
        rigid, flexible = compute_jacobians(linkage, linkage.general_pose)
        unit = np.tile([1.0, 1.0, linkage.size], len(linkage.index))  # d/d(angle L) = d/d(angle)/L for the longest link L
        order = sorted(linkage.permanent_rows, key=lambda k: linkage.rows[k].motion is None)
        matrix = np.hstack([rigid / unit, flexible / (np.abs(flexible).max(initial=0.0) or 1.0)])[order]
        return [linkage.names[k] for k in order], matrix

    @cached_property
    def remarks(self) -> list[str]:
        """Remarks in sentences: redundant constraints, too many drives, and what seems to be missing."""
        return remarks(self.linkage, self.redundant, self.undetermined)

    @cached_property
    def is_determined(self) -> bool:
        """True if constraints and drives alone determine the pose: as many independent constraints as coordinates."""
        if any(link.body.flexible for link in self.mechanism.links) or not self.mechanism.drives:
            return False
        rows, coordinates = self.linkage.rows, self.linkage.reference.size
        has_clearance = any(row.start_only for row in rows)  # its rows hold at t = 0 only
        return len(rows) >= coordinates and not has_clearance and self.linkage.count_free_motions() == 0

    @cached_property
    def why_not_kinematic(self) -> str:
        """Reason why joints and drives do not decide the motion and all forces, so that runs must integrate; '' if they do."""
        mechanism = self.mechanism
        if not self.is_determined:
            bend = [link.name for link in mechanism.links if link.body.flexible]
            # they: joints and drives, with which the messages that end with this reason begin
            return f"link '{bend[0]}' bends" if bend else "here they leave the linkage free, or nothing drives it"
        if mechanism.stops:
            return f"a contact at '{mechanism.stops[0].point}' begins and ends between steps"
        rubbing = [guide.key for guide in mechanism.guides if guide.friction_needs_reaction]
        if rubbing:
            return f"friction of '{rubbing[0]}' follows its reaction"
        no_multipliers = np.empty((0, 3))  # (times, rows): no time, as many rows as an element may have
        for name, element in self.elements.items():
            if element.has_states:
                return f"states of '{name}' are integrated"
            if name in self.linkage.names and element.reactions(no_multipliers) is None:  # for any multipliers
                return f"'{name}' does not tell its reaction"
        for element in (*mechanism.loads, *mechanism.couplings):
            has_rows = any(element.rows(mechanism))  # then its force is its reaction
            has_force = type(element).pushes is not Element.pushes  # the method of the base class returns None
            if not (has_rows or has_force):
                return f"'{element.key}' does not tell its force in a known motion"
        return ""

    @property
    def is_kinematic(self) -> bool:
        """True if constraints alone determine the motion, and all elements have known forces in a known motion."""
        return not self.why_not_kinematic

    @cached_property
    def mass(self) -> float:
        """Mass of all links, sliders and point masses [kg]."""
        links = [link.mass(self.mechanism.length(link.name)) for link in self.mechanism.links if not link.body.massless]
        return sum(links) + sum(guide.mass for guide in self.mechanism.guides) + sum(each.mass for each in self.mechanism.masses)

    @cached_property
    def axial_period(self) -> float:
        """Upper bound of axial periods [s]: all mass on one flexible link as a spring; 0 without flexible links."""
        flexible = [link for link in self.mechanism.links if link.body.flexible]
        compliances = [self.mechanism.length(link.name) / link.body.section.axial_stiffness for link in flexible]  # [m/N]
        return 2 * pi * sqrt(self.mass * max(compliances, default=0.0))

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which a drive or load has a kink or jump, in order [s]."""
        times = {t for element in self.elements.values() for t in element.kinks(duration)}
        # `step_ends`: around kinks of users' functions of states that `simulate` found in the run before this one
        return tuple(sorted(times.union(step_ends(duration))))

    @cached_property
    def is_stiffly_damped(self) -> bool:
        """True if contacts damp the lightest link at 1e5/s or more (chosen): explicit steps are stable below some 3/rate."""
        laws = [joint.law for joint in self.clearances]
        lightest = min(link.mass(self.mechanism.length(link.name)) for link in self.mechanism.links)  # also of struts
        depth = 1e-5  # [m], between the depths of light and hard impacts
        speed, onset = 1e-3, 0.1  # of penetration, small, and at the onset of a moderate impact [m/s]: some laws divide by it
        changes = [law.force(depth, speed, onset) - law.force(depth, 0.0, onset) for law in laws]
        return max(changes, default=0.0) / speed / lightest >= 1e5

    @cached_property
    def is_explicit_in_exudyn(self) -> bool:
        """True if Exudyn runs explicitly: nothing is constrained or stiff, and no element has states of its own."""
        mechanism = self.mechanism
        return (
            bool(mechanism.joints)
            and len(self.clearances) == len(mechanism.joints)
            and not any(link.body.flexible for link in mechanism.links)
            and not any(each.has_states for each in mechanism.loads)
            and not (mechanism.guides or mechanism.stops or mechanism.couplings)
            and all(isinstance(drive.speed, int | float) for drive in mechanism.drives)  # kept by a huge inertia, no constraint
            and not self.is_stiffly_damped
        )
