CREATE TABLE facts (key TEXT PRIMARY KEY, value TEXT NOT NULL, digest TEXT NOT NULL DEFAULT '') WITHOUT ROWID;
CREATE TABLE instances (
    id INTEGER PRIMARY KEY, identity TEXT NOT NULL, theta TEXT NOT NULL, digest TEXT NOT NULL DEFAULT '',
    UNIQUE (identity, theta));
CREATE TABLE trials (
    objective TEXT NOT NULL, number INTEGER NOT NULL, instance INTEGER NOT NULL REFERENCES instances (id),
    state TEXT NOT NULL CHECK (state IN ('open', 'finished', 'failed', 'cut')),
    score REAL, measures TEXT NOT NULL DEFAULT '{}', failed_episodes INTEGER NOT NULL DEFAULT 0,
    failure TEXT NOT NULL DEFAULT '', decided TEXT NOT NULL DEFAULT '[]', bound REAL, seconds REAL NOT NULL DEFAULT 0,
    digest TEXT NOT NULL DEFAULT '', PRIMARY KEY (objective, number)) WITHOUT ROWID;
CREATE TABLE episodes (
    instance INTEGER NOT NULL REFERENCES instances (id), agent TEXT NOT NULL, start INTEGER NOT NULL,
    seed INTEGER NOT NULL, metrics TEXT, failure TEXT, seconds REAL NOT NULL, code TEXT,
    digest TEXT NOT NULL DEFAULT '',
    PRIMARY KEY (instance, agent, start, seed), CHECK ((metrics IS NULL) <> (failure IS NULL))) WITHOUT ROWID;
CREATE TABLE sweeps (
    number INTEGER PRIMARY KEY, parameter TEXT NOT NULL, base TEXT NOT NULL, points TEXT NOT NULL,
    identity TEXT NOT NULL, target_model TEXT NOT NULL DEFAULT '', replays TEXT NOT NULL DEFAULT '',
    digest TEXT NOT NULL DEFAULT '', UNIQUE (parameter, base, points, identity, replays));
CREATE TABLE under_way (
    place INTEGER PRIMARY KEY CHECK (place = 1), identity TEXT NOT NULL, theta TEXT NOT NULL, agent TEXT NOT NULL,
    start INTEGER NOT NULL, seed INTEGER NOT NULL, digest TEXT NOT NULL DEFAULT '');
CREATE TABLE counts (name TEXT PRIMARY KEY, rows INTEGER NOT NULL) WITHOUT ROWID;
