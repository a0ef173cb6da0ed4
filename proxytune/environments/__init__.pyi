from .family import agent_of as agent_of, gymnasium_family as gymnasium_family
