"""How fast each search engine finds a good θ: test problems, runs, judgement and summary."""
