from .family import agent_of as agent_of
