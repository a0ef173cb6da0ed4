from .bank import bank_document as bank_document, bank_text as bank_text, write_bank_page as write_bank_page
from .decision import sequential_sentence as sequential_sentence
from .diagnosis.answer import (
    diagnosis_figures as diagnosis_figures,
    diagnosis_headline as diagnosis_headline,
    diagnosis_notes as diagnosis_notes,
    diagnosis_text as diagnosis_text,
    diagnosis_view as diagnosis_view,
    write_diagnosis as write_diagnosis,
)
from .diagnosis.document import (
    camera_noise_floor as camera_noise_floor,
    clocks_document as clocks_document,
    diagnosis_document as diagnosis_document,
)
from .diagnosis.notes import clocks_notes as clocks_notes
from .drive.figure import (
    episode_document as episode_document,
    episode_figure as episode_figure,
    episode_text as episode_text,
    say_parting as say_parting,
)
from .drive.movie import (
    NO_PLACES as NO_PLACES,
    check_episode_file as check_episode_file,
    write_episode as write_episode,
)
from .export.instance import (
    FILTER as FILTER,
    FORMATS as FORMATS,
    IN_WHEELS as IN_WHEELS,
    ExportLine as ExportLine,
    Instance as Instance,
    export_lines as export_lines,
)
from .export.into import patch as patch
from .export.mjcf import mjcf_text as mjcf_text
from .export.ros import node_text as node_text, ros_text as ros_text
from .export.urdf import end_of as end_of, urdf_text as urdf_text
from .families import (
    families_document as families_document,
    families_figure as families_figure,
    families_sentence as families_sentence,
    families_text as families_text,
    families_view as families_view,
)
from .figure_style import (
    BLUE as BLUE,
    COLUMN as COLUMN,
    GREEN as GREEN,
    GREY as GREY,
    LIGHT_BLUE as LIGHT_BLUE,
    LIGHT_GREY as LIGHT_GREY,
    ORANGE as ORANGE,
    PURPLE as PURPLE,
    VERMILLION as VERMILLION,
    LineName as LineName,
    dress as dress,
    grid_of as grid_of,
    name_lines as name_lines,
)
from .fleet import (
    fleet_document as fleet_document,
    fleet_figure as fleet_figure,
    fleet_sentence as fleet_sentence,
    fleet_text as fleet_text,
    fleet_view as fleet_view,
)
from .html import Shown as Shown, frame_html as frame_html, write_page as write_page
from .meanings import clause_of as clause_of, findings as findings, what_it_does as what_it_does
from .plv_search import plv_document as plv_document, plv_text as plv_text, write_plv_report as write_plv_report
from .scores import (
    figures_of_scores as figures_of_scores,
    ranking_document as ranking_document,
    score_document as score_document,
    score_sentence as score_sentence,
    score_text as score_text,
    score_view as score_view,
    write_score_report as write_score_report,
    write_score_table as write_score_table,
)
from .study.document import study_document as study_document
from .study.figures import study_figures as study_figures
from .study.page import (
    RENEW_S as RENEW_S,
    study_foot as study_foot,
    study_text as study_text,
    study_view as study_view,
    write_live_page as write_live_page,
    write_study_tables as write_study_tables,
)
from .study.sentence import study_sentence as study_sentence
from .sweep import (
    curve_document as curve_document,
    curve_name as curve_name,
    figures_of_sweep as figures_of_sweep,
    held_alike as held_alike,
    held_values as held_values,
    sweep_text as sweep_text,
    sweep_view as sweep_view,
    write_curves as write_curves,
    write_sweep_page as write_sweep_page,
)
from .teaching import (
    teach_document as teach_document,
    teach_figure as teach_figure,
    teach_text as teach_text,
    teach_view as teach_view,
)
from .text import (
    check_table_file as check_table_file,
    group_texts as group_texts,
    note_texts as note_texts,
    table_text as table_text,
)
from .view import (
    Column as Column,
    Paragraphs as Paragraphs,
    Picture as Picture,
    Table as Table,
    View as View,
    columns_of as columns_of,
    foot_of as foot_of,
)
from .wording import (
    digits as digits,
    fixed as fixed,
    in_pairs as in_pairs,
    listed as listed,
    percent as percent,
    plain as plain,
    short as short,
    short_span as short_span,
    span as span,
    with_span as with_span,
    with_unit as with_unit,
)
from .writing import (
    CAPTIONS as CAPTIONS,
    figures_also_as as figures_also_as,
    picture_of as picture_of,
    save_figure as save_figure,
    save_figures as save_figures,
    svg_of as svg_of,
    write_picture as write_picture,
    write_text as write_text,
)
