"""A study, from study.toml to its result.

settings         what study.toml says
family           the domain family that it names, and the code that a user brings
guard            what stands between a user's family and the rest
opening          a study ready to run: settings, family, target, objective, engine
study_run        from θ to episodes, outcomes and PRPV, all kept in the store
preflight        before the first trial: dead parameters, agents that are not repeatable, noise
pruning          a trial is stopped once it cannot be among the best
facts            what trials depend on, and how a resume compares it with study.db
run              the stages of a study: trials, when they end, fresh episodes
result           what was found; other metrics; trials for other optimisers
families         several tuned families beside one another
robots           several robots of one kind: θ of each, and p(θ) over them
single_episode   one episode, to look at
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
