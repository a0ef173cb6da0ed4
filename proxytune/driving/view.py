"""What a robot's camera shows while it drives: the newest picture, at the camera's rate."""

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agents import Picture
from proxytune.driving.cameras import Camera
from proxytune.effects import Chain, Setting, Signal


class _Film(Protocol):
    """How pictures are made of what the camera sees."""

    def expose(self, poses: Signal) -> Picture:
        """The picture after the poses (ticks, 3) since the one before."""
        ...


class _Averaged:
    """Each picture is a weighted mean of what the camera saw at the last ticks, which is all that blur does."""

    def __init__(self, camera: Camera, weights: Signal, start: Signal) -> None:
        self._glimpse = getattr(camera, "glimpse", camera.render)
        self._mean = getattr(camera, "mean", mean_picture)
        self._weights = weights
        self._glimpses = np.repeat(self._glimpse(start[None]), len(weights), axis=0)

    def expose(self, poses: Signal) -> Picture:
        """The picture after some more poses; of more than are averaged the last ones are rendered."""
        latest = self._glimpse(poses[-len(self._weights) :])
        kept = self._glimpses[len(latest) :]
        self._glimpses = np.concatenate((kept, latest)) if len(kept) else latest
        return np.asarray(self._mean(self._glimpses, self._weights))


class _Developed:
    """Image effects are done to every picture, one after another."""

    def __init__(self, camera: Camera, effects: Chain, setting: Setting) -> None:
        self._camera, self._effects = camera, effects
        still = camera.render(setting.rest[None]).reshape(-1)
        self._memory = effects.begin(replace(setting, rest=still))

    def expose(self, poses: Signal) -> Picture:
        """The picture after some more poses."""
        pictures = self._camera.render(poses)
        signal = pictures.reshape(len(pictures), -1).astype(np.float32)
        developed, self._memory = self._effects.apply(signal, self._memory)
        levels = np.minimum(np.maximum(np.rint(developed[-1]), 0), 255)
        return np.asarray(levels.astype(np.uint8).reshape(pictures.shape[1:]))


class View:
    """The camera with its image effects: the newest picture, at the camera's rate.

    Attributes:
        picture: That picture, (rows, columns, 3).
    """

    def __init__(self, camera: Camera, effects: Chain, setting: Setting) -> None:
        """Take the first picture; `setting` is that of poses, and its rest where the robot stood before them, (3,)."""
        weights = effects.mean_weights(setting.rate_hz)
        self._film: _Film = (
            _Developed(camera, effects, setting) if weights is None else _Averaged(camera, weights, setting.rest)
        )
        self._every = round(setting.rate_hz / setting.nominal["camera_rate"])
        self._waiting = np.empty((0, 3))
        self.picture = self._film.expose(setting.rest[None])

    def pass_by(self, poses: Signal) -> None:
        """Let the shutter see the poses of the next ticks."""
        self._waiting = np.concatenate((self._waiting, poses))
        while len(self._waiting) >= self._every:
            seen, self._waiting = self._waiting[: self._every], self._waiting[self._every :]
            self.picture = self._film.expose(seen)


def mean_picture(pictures: NDArray[np.uint8], weights: Signal) -> Picture:
    """The weighted mean of pictures (n, rows, columns, 3) as a picture."""
    mean = weights @ pictures.reshape(len(pictures), -1).astype(np.float32)
    return np.asarray(np.rint(mean).astype(np.uint8).reshape(pictures.shape[1:]))
