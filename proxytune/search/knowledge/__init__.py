"""What the finished trials say of θ."""
