"""What proposes the next θ, one module each, and the registry of all."""
