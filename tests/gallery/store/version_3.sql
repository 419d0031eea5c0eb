BEGIN TRANSACTION;
CREATE TABLE fpmatch_audit (
	number INTEGER NOT NULL, 
	line TEXT NOT NULL, 
	PRIMARY KEY (number)
);
INSERT INTO "fpmatch_audit" VALUES(1,'{"time": "2026-11-29T15:46:15.087+00:00", "client": "ada", "action": "audit on", "state": "f4d7c2f65337e838", "previous": "0000000000000000000000000000000000000000000000000000000000000000"}');
INSERT INTO "fpmatch_audit" VALUES(2,'{"time": "2026-11-29T15:46:15.149+00:00", "client": "ada", "action": "enrol", "entries": [{"number": 1, "subject": "s1", "finger": "left", "impression": "1", "sha256": "0101010101010101010101010101010101010101010101010101010101010101"}, {"number": 2, "subject": "s2", "finger": "left", "impression": "2", "sha256": "0202020202020202020202020202020202020202020202020202020202020202"}, {"number": 3, "subject": "s3", "finger": "left", "impression": "3", "sha256": "0303030303030303030303030303030303030303030303030303030303030303"}], "failed": 1, "state": "cfdf4b607caa6af7", "previous": "10bdb1374608462cb720729458d830a3004a3be4b8803b9bde746206438fcd4f"}');
INSERT INTO "fpmatch_audit" VALUES(3,'{"time": "2026-11-29T15:46:15.328+00:00", "client": "ada", "action": "remove", "entries": [{"number": 2, "subject": "s2", "finger": "left", "impression": "2"}], "state": "a1e080702050d2c5", "previous": "2f85f6f88803cfab4ea5f3e752645e0648fbec9ba0c955042def4552137915ed"}');
CREATE TABLE fpmatch_entry (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	subject TEXT NOT NULL, 
	finger TEXT NOT NULL, 
	impression TEXT NOT NULL, 
	source TEXT NOT NULL, 
	content BLOB NOT NULL, 
	dpi FLOAT NOT NULL, 
	minutiae INTEGER NOT NULL, 
	digest BIGINT, 
	template BLOB NOT NULL, 
	UNIQUE (subject, finger, impression), 
	UNIQUE (content)
);
INSERT INTO "fpmatch_entry" VALUES(1,'s1','left','1','/prints/1.tif',X'0101010101010101010101010101010101010101010101010101010101010101',500.0,3,266238321644802,X'666D020220A107002C01900103000A000500050302A80E00143D6664A119E000008041020002000000000002000200F03333000000000000000000000000000000010000000000000002000000000000000335391C9D');
INSERT INTO "fpmatch_entry" VALUES(3,'s3','left','3','/prints/3.tif',X'0303030303030303030303030303030303030303030303030303030303030303',500.0,3,98030268810919,X'666D020220A107002C0190010300140005000403A0A00E00143D6664A119E000008041020002000000000002000200F03333000000000000000000000000000000010000000000000002000000000000000361DF947E');
CREATE TABLE fpmatch_failure (
	source TEXT NOT NULL, 
	reason TEXT NOT NULL, 
	PRIMARY KEY (source)
);
INSERT INTO "fpmatch_failure" VALUES('/prints/bad.tif','blank');
CREATE TABLE fpmatch_gallery (
	id INTEGER NOT NULL CHECK (id = 1), 
	version INTEGER NOT NULL, 
	state TEXT NOT NULL, 
	sums BLOB, 
	PRIMARY KEY (id)
);
INSERT INTO "fpmatch_gallery" VALUES(1,3,'a1e080702050d2c50e2972ce71f4943c',X'0000000000000000ADDBEFE34C4B0100');
CREATE TABLE fpmatch_removal (
	number INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	entry INTEGER NOT NULL, 
	finger INTEGER
);
INSERT INTO "fpmatch_removal" VALUES(1,2,NULL);
CREATE TABLE fpmatch_state (
	state TEXT NOT NULL, 
	PRIMARY KEY (state)
)
 WITHOUT ROWID

;
INSERT INTO "fpmatch_state" VALUES('a1e080702050d2c50e2972ce71f4943c');
INSERT INTO "fpmatch_state" VALUES('cfdf4b607caa6af7639d6e621b4904b3');
INSERT INTO "fpmatch_state" VALUES('f4d7c2f65337e8384d007ae647438916');
CREATE TRIGGER fpmatch_history_state AFTER UPDATE OF state ON fpmatch_gallery BEGIN INSERT INTO fpmatch_state (state) SELECT NEW.state WHERE NOT EXISTS (SELECT 1 FROM fpmatch_state WHERE state = NEW.state); END;
CREATE TRIGGER fpmatch_history_removal AFTER DELETE ON fpmatch_entry BEGIN INSERT INTO fpmatch_removal (entry, finger) VALUES (OLD.id, (SELECT min(id) FROM fpmatch_entry WHERE subject = OLD.subject AND finger = OLD.finger)); END;
CREATE TRIGGER fpmatch_history_insert AFTER INSERT ON fpmatch_entry WHEN NEW.id < (SELECT max(id) FROM fpmatch_entry) BEGIN DELETE FROM fpmatch_state; UPDATE fpmatch_gallery SET state = lower(hex(randomblob(16))); END;
CREATE TRIGGER fpmatch_history_update AFTER UPDATE OF id, subject, finger ON fpmatch_entry BEGIN DELETE FROM fpmatch_state; UPDATE fpmatch_gallery SET state = lower(hex(randomblob(16))); END;
CREATE TRIGGER fpmatch_audit_update BEFORE update ON fpmatch_audit BEGIN SELECT RAISE(ABORT, 'the audit of a gallery is only appended to'); END;
CREATE TRIGGER fpmatch_audit_delete BEFORE delete ON fpmatch_audit BEGIN SELECT RAISE(ABORT, 'the audit of a gallery is only appended to'); END;
CREATE TRIGGER fpmatch_audit_insert BEFORE INSERT ON fpmatch_audit WHEN EXISTS (SELECT 1 FROM fpmatch_audit WHERE number >= NEW.number) BEGIN SELECT RAISE(ABORT, 'the audit of a gallery is only appended to'); END;
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('fpmatch_entry',3);
INSERT INTO "sqlite_sequence" VALUES('fpmatch_removal',1);
COMMIT;
