"""What proposes the next θ; it never calls a simulator."""
