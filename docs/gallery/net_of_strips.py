"""A net of a hundred strips.

Strips 0.5 mm thick are the sides of a net's meshes. Drawn square, with gravity aslant, it is let go and
shears. Where it hangs at rest, the joints along its upper edge carry its weight.
"""

from math import hypot

from buckler.mbs import Cable, Link, Mechanism, Revolute, Section, equilibrium, frequencies, simulate

side, wide, high = 0.1, 13, 4
strip = Cable(Section(width=0.010, thickness=0.5e-3))
down = [((i, j), (i, j + 1)) for j in range(high) for i in range(wide)]
across = [((i, j), (i + 1, j)) for j in range(1, high + 1) for i in range(wide - 1)]
holders: dict[tuple[int, int], str] = {}
links, joints = [], []
for k, ends in enumerate(down + across):
    names = [f"P{i}_{j}" for i, j in ends]
    links.append(Link(f"strip{k}", *names, strip))
    for knot, name in zip(ends, names, strict=True):
        if knot[1] == 0 or knot in holders:
            joints.append(Revolute(name, holders.get(knot, "ground"), f"strip{k}"))
        holders.setdefault(knot, f"strip{k}")
points = {f"P{i}_{j}": (side * i, -side * j) for ends in down + across for i, j in ends}
mechanism = Mechanism(points, links, joints, gravity=(6.94, -6.94))
result = simulate(mechanism, duration=0.15, accuracy=1e-2)

rest = equilibrium(mechanism)
tops = [f"P{i}_0.ground-strip{i}" for i in range(wide)]
held = hypot(*sum(rest.reaction(name) for name in tops))
weight = len(links) * strip.section.mass_per_length * side * hypot(*mechanism.gravity)
tones = frequencies(mechanism, rest, count=20)
print(f"held by {held:.9f} N; weight {weight:.9f} N; slowest of {len(tones.hertz)} tones {tones.hertz[0]:.6f} Hz")
assert rest.stable and abs(held / weight - 1) < 1e-9
