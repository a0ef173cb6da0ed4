"""The learnt remainder as an effect like any other."""
