"""Brightness, sharpness, noise and blemishes of pictures."""
