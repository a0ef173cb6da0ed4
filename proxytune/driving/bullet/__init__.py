"""All that runs on PyBullet: the reference plant and the reference camera."""
