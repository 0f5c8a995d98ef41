"""Measures the time of a call of the Python module before any computation, and compares it with a bound.
Also measures the transfer of a result to the interpreter. Exits 1 when a bound is exceeded."""

import sys
import timeit

import numpy

import levelsmith as ls

BOUND = 20e-6  # seconds for a lazy node

ball = ls.sphere(radius=1, voxel=0.02).compute()
mesh = ball.mesh().compute()


def best(call, number):
    return min(timeit.repeat(call, number=number, repeat=7)) / number


missed = False
for name, call in {
    "sphere(radius, voxel)": lambda: ls.sphere(radius=1, voxel=0.1),
    "sphere, four options": lambda: ls.sphere(radius=1, center=(0, 0, 0), voxel=0.1, half_width=4),
    "ball.offset(0.1)": lambda: ball.offset(0.1),
    "ball | ball": lambda: ball | ball,
}.items():
    cost = best(call, 2000)
    missed = missed or cost > BOUND
    print(f"{name:24} {cost * 1e6:8.2f} µs   bound {BOUND * 1e6:.0f}")
for name, call, number in (
    ("compute, known", ball.compute, 200),
    ("vertices", lambda: mesh.vertices, 2000),
    ("info()", ball.info, 20),
    ("array()", ball.array, 5),
):
    print(f"{name:24} {best(call, number) * 1e6:8.2f} µs")
values = ball.array()
print(f"array of {values.size / 1e6:.1f} M values, {numpy.asarray(values).nbytes / 1e6:.0f} MB")
sys.exit(missed)
