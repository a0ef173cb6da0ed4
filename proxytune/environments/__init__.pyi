from .family import PolicyAgent as PolicyAgent, agent_of as agent_of
