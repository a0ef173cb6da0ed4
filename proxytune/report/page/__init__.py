"""One page of one design for all that finds something: the answer, what is next, figures, tables, the foot."""

from proxytune.report.page.foot import foot_of
from proxytune.report.page.parts import Foot, Page, Picture, Table, Words
from proxytune.report.page.rendering import html_of
from proxytune.report.page.tables import terminal_tables

__all__ = ["Foot", "Page", "Picture", "Table", "Words", "foot_of", "html_of", "terminal_tables"]
