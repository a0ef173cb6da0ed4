"""A signal through an effect, as tests of single effects ask for it."""

import numpy as np

from proxytune.effects import FilterContext


def filtered(effect, signal, *, rate_hz=60.0, rest=0.0, nominal=None, seed=0, cut=None, **known):
    """The signal (…, time, channels) through the effect, in one go or cut in two; `rest` is one value or one each."""
    signal = np.asarray(signal, dtype=float)
    resting = np.broadcast_to(np.asarray(rest, dtype=float), (*signal.shape[:-2], signal.shape[-1]))
    known = {name: np.asarray(values, dtype=float) for name, values in known.items()}
    memory = effect.begin(FilterContext(rate_hz, resting, nominal or {}, seed, **known))
    first, memory = effect.apply(signal[..., :cut, :], memory)
    return first if cut is None else np.concatenate((first, effect.apply(signal[..., cut:, :], memory)[0]), axis=-2)
