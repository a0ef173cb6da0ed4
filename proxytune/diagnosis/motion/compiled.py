"""The inner loops of a diagnosis of motion compiled by Numba: the likelihood of noise, and dead reckoning.

`walk` is the arithmetic of `innovations.integrate_twists`, operation by operation; `loss` rounds otherwise than LAPACK.
"""

from typing import Any

import numba
import numpy as np

from proxytune.diagnosis.motion.drives import Floats
from proxytune.diagnosis.motion.innovations import SMALLEST_TURN

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, these loops take a thousand times as long")

# Signatures are compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_compiled: dict[str, Any] = {"nopython": True, "nogil": True, "cache": True, "error_model": "numpy"}


def walk(twists: Floats, tick_s: float) -> Floats:
    """Dead-reckon planar poses (E, T + 1, 3) from body twists (E, T, 3) held for a tick each."""
    poses = np.zeros((len(twists), twists.shape[1] + 1, 3))
    middle, quarter = np.empty(twists.shape[:2]), np.empty(twists.shape[:2])
    _turn(twists, tick_s, middle, quarter, poses)
    _step(twists, tick_s, np.tan(middle, out=middle), quarter, np.tan(quarter), poses)
    return poses


def _head(twists, tick_s, middle, quarter, poses):  # type: ignore[no-untyped-def]
    for episode in range(twists.shape[0]):
        heading = 0.0
        for tick in range(twists.shape[1]):
            turn = twists[episode, tick, 2] * tick_s
            heading += turn
            poses[episode, tick + 1, 2] = heading
            turn = turn if abs(turn) > SMALLEST_TURN else EPSILON
            middle[episode, tick], quarter[episode, tick] = 0.5 * heading - 0.25 * turn, 0.25 * turn


def _advance(twists, tick_s, middle, quarter, bend, poses):  # type: ignore[no-untyped-def]
    for episode in range(twists.shape[0]):
        x = y = 0.0
        for tick in range(twists.shape[1]):
            tangent, bent = middle[episode, tick], bend[episode, tick]
            square = tangent * tangent
            chord = 4.0 * tick_s * bent / ((1.0 + bent * bent) * (1.0 + square) * (4.0 * quarter[episode, tick]))
            forward, sideways = twists[episode, tick, 0] * chord, twists[episode, tick, 1] * chord
            cosine, sine = 1.0 - square, 2.0 * tangent
            x += forward * cosine - sideways * sine
            y += forward * sine + sideways * cosine
            poses[episode, tick + 1, 0], poses[episode, tick + 1, 1] = x, y


def _weigh(band, errors, most):  # type: ignore[no-untyped-def]
    """Huber's loss, linear beyond `most`, of whitened errors (N, 3), and ½ log|S| of their covariance (6, N, 3).

    S = LDLᵀ with ones on L's diagonal: `lower` of an increment's own block, `w` D of what it shares with the one before
    it. Square roots of D are of the loss alone, so that no increment has to wait for those before it.
    """
    loss, product = 0.0, 1.0
    s00 = s10 = s20 = s01 = s11 = s21 = s02 = s12 = s22 = 0.0
    l10 = l20 = l21 = 0.0
    i0 = i1 = i2 = 0.0
    z0 = z1 = z2 = 0.0
    for n in range(band.shape[1]):
        w00, w10, w20 = s00, s10, s20
        w01, w11, w21 = s01 - w00 * l10, s11 - w10 * l10, s21 - w20 * l10
        w02, w12, w22 = s02 - w00 * l20 - w01 * l21, s12 - w10 * l20 - w11 * l21, s22 - w20 * l20 - w21 * l21
        k00, k01, k02 = w00 * i0, w01 * i1, w02 * i2
        k10, k11, k12 = w10 * i0, w11 * i1, w12 * i2
        k20, k21, k22 = w20 * i0, w21 * i1, w22 * i2
        z0, z1, z2 = (
            errors[n, 0] - (k00 * z0 + k01 * z1 + k02 * z2),
            errors[n, 1] - (k10 * z0 + k11 * z1 + k12 * z2),
            errors[n, 2] - (k20 * z0 + k21 * z1 + k22 * z2),
        )
        d0 = band[0, n, 0] - (k00 * w00 + k01 * w01 + k02 * w02)
        c10 = band[1, n, 0] - (k10 * w00 + k11 * w01 + k12 * w02)
        c20 = band[2, n, 0] - (k20 * w00 + k21 * w01 + k22 * w02)
        d1 = band[0, n, 1] - (k10 * w10 + k11 * w11 + k12 * w12)
        c21 = band[1, n, 1] - (k20 * w10 + k21 * w11 + k22 * w12)
        d2 = band[0, n, 2] - (k20 * w20 + k21 * w21 + k22 * w22)
        i0 = 1.0 / d0
        l10, l20 = c10 * i0, c20 * i0
        d1 -= l10 * c10
        i1 = 1.0 / d1
        c21 -= l20 * c10
        l21 = c21 * i1
        d2 -= l20 * c20 + l21 * c21
        i2 = 1.0 / d2
        z1 -= l10 * z0
        z2 -= l20 * z0 + l21 * z1
        for z, inverse in ((z0, i0), (z1, i1), (z2, i2)):
            size = abs(z) * np.sqrt(inverse)
            inner = min(size, most)
            loss += inner * (size - 0.5 * inner)
        product *= d0 * d1 * d2
        if n % 8 == 7:  # a logarithm takes as long as a block
            loss += 0.5 * np.log(product)
            product = 1.0
        s00, s10, s20 = band[3, n, 0], band[4, n, 0], band[5, n, 0]
        s01, s11, s21 = band[2, n, 1], band[3, n, 1], band[4, n, 1]
        s02, s12, s22 = band[1, n, 2], band[2, n, 2], band[3, n, 2]
    return loss + 0.5 * np.log(product)


EPSILON = float(np.finfo(float).eps)
_GRID, _POSES = "float64[:,::1]", "float64[:,:,::1]"
_turn = numba.jit(f"void(float64[:,:,:], float64, {_GRID}, {_GRID}, {_POSES})", **_compiled)(_head)
_step = numba.jit(f"void(float64[:,:,:], float64, {_GRID}, {_GRID}, {_GRID}, {_POSES})", **_compiled)(_advance)
loss = numba.jit(f"float64({_POSES}, {_GRID}, float64)", **_compiled)(_weigh)
"""Minus the log-likelihood of errors (N, 3) by their covariance in lower banded form (6, N, 3)."""
