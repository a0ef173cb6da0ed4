from .family import agent_of as agent_of
from .given import played_environment as played_environment
