"""How a page looks: on a desk, on a phone, in the dark and in print."""

STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1d2126; --soft: #5a626c; --line: #d9dde2; --tint: #f1f5f9;
  --accent: #0072b2; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #15181c; --ink: #e6e8ea; --soft: #a3abb4; --line: #3a414a; --tint: #20262d; --accent: #6cc0f0; }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 0 auto; padding: 1.5rem 1rem 3rem;
  color: var(--ink); background: var(--paper); overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 1rem; }
h2 { font-size: 1.15rem; margin: 2.5rem 0 .5rem; }
.answer { font-size: 1.15rem; margin: 0 0 1rem; }
.following, .under-way { padding: .6rem .9rem; border-left: .25rem solid var(--accent); background: var(--tint); }
.under-way { border-left-color: #e69f00; }
figure { margin: 0; }
figcaption, .notes, footer { color: var(--soft); font-size: .93rem; }
.notes { padding-left: 1.2rem; }
.scroll { overflow-x: auto; }
.scroll:focus-visible { outline: 2px solid var(--accent); }
.card { display: block; width: fit-content; max-width: 100%; min-width: min-content; background: #fff; padding: .5rem;
  border: 1px solid var(--line); border-radius: .4rem; }
img { display: block; max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: .93rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: .25rem 1.1rem .25rem 0; border-bottom: 1px solid var(--line);
  overflow-wrap: normal; }
thead th { color: var(--soft); vertical-align: bottom; }
tbody th { font-weight: 600; white-space: pre-wrap; }
td.prose { min-width: 11rem; }
table:not(:has(thead)) td { overflow-wrap: anywhere; }
.number { text-align: right; white-space: nowrap; }
thead .number { white-space: normal; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
pre { background: var(--tint); padding: .6rem .9rem; overflow-x: auto; }
code { font: .92em/1.5 ui-monospace, monospace; }
pre code { white-space: pre-wrap; }
nav ol { columns: 16rem; column-gap: 3rem; padding-left: 1.8rem; }
nav li { break-inside: avoid; }
a { color: var(--accent); }
footer { margin-top: 3rem; border-top: 1px solid var(--line); }
@media print {
  :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #333; --line: #bbb; --tint: #f4f4f4; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  .scroll { overflow: visible; }
  table { font-size: 8.5pt; }
  th, td { padding-right: .6rem; }
  td.prose { min-width: 0; }
  .number { white-space: normal; }
  img { max-height: 7.5cm; width: auto; min-width: 0 !important; }
  section, figure, tr, .following { break-inside: avoid; }
  h2 { break-after: avoid; }
  thead { display: table-header-group; }
  nav, .under-way { display: none; }
}
"""
