ALTER TABLE under_way RENAME TO one_under_way;
CREATE TABLE under_way (
    place INTEGER PRIMARY KEY, identity TEXT NOT NULL, theta TEXT NOT NULL, agent TEXT NOT NULL,
    start INTEGER NOT NULL, seed INTEGER NOT NULL, digest TEXT NOT NULL DEFAULT '');
INSERT INTO under_way SELECT * FROM one_under_way;
DROP TABLE one_under_way;
