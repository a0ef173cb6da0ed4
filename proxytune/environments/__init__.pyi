from .family import agent_of as agent_of, played_environment as played_environment
