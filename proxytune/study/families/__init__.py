"""A study of several domain families: which simulator should be used, and for what?"""
