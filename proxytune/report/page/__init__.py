"""One page of one design for every command that finds something: the answer, what to do next, figures, tables, the foot."""

from proxytune.report.page.parts import Foot, Page, Picture, Table, Words
from proxytune.report.page.rendering import html_of

__all__ = ["Foot", "Page", "Picture", "Table", "Words", "html_of"]
