"""How useful is a robot simulator, which parameters make it most useful, and what does it still lack?"""
