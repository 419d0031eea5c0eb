BEGIN TRANSACTION;
CREATE TABLE fpmatch_audit (
	number INTEGER NOT NULL, 
	line TEXT NOT NULL, 
	PRIMARY KEY (number)
);
INSERT INTO "fpmatch_audit" VALUES(1,'{"time": "2026-11-29T15:46:15.407+00:00", "client": "ada", "action": "audit on", "state": "4e207e672229a060", "previous": "0000000000000000000000000000000000000000000000000000000000000000"}');
INSERT INTO "fpmatch_audit" VALUES(2,'{"time": "2026-11-29T15:46:15.473+00:00", "client": "ada", "action": "enrol", "entries": [{"number": 1, "subject": "s1", "finger": "left", "impression": "1", "sha256": "0101010101010101010101010101010101010101010101010101010101010101"}, {"number": 2, "subject": "s2", "finger": "left", "impression": "2", "sha256": "0202020202020202020202020202020202020202020202020202020202020202"}, {"number": 3, "subject": "s3", "finger": "left", "impression": "3", "sha256": "0303030303030303030303030303030303030303030303030303030303030303"}], "failed": 1, "state": "c624b83b1688aa1e", "previous": "baf9563db37fc44c8acd9053fa6148481b0c8477e57e8f25494ab20922aaa876"}');
INSERT INTO "fpmatch_audit" VALUES(3,'{"time": "2026-11-29T15:46:15.520+00:00", "client": "ada", "action": "remove", "entries": [{"number": 2, "subject": "s2", "finger": "left", "impression": "2"}], "state": "539e566ec7d86a84", "previous": "dc26f1b94d96c25d6136c669d57f259259c4536d2c4eff05f2f91f5f0ec69dbe"}');
CREATE TABLE fpmatch_encryption (
	id INTEGER NOT NULL CHECK (id = 1), 
	gallery BLOB NOT NULL, 
	keys TEXT NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "fpmatch_encryption" VALUES(1,X'E40919C9066DCB05897B674506A91050','f22ce7dac3d19adb');
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
INSERT INTO "fpmatch_entry" VALUES(1,'s1','left','1','/prints/1.tif',X'0101010101010101010101010101010101010101010101010101010101010101',500.0,3,15209856826701,X'894650530D0A1A01F22CE7DAC3D19ADBE91856EB4438B32607F3C96BA8AD01D0106640ACABBDA3EADCECDEFA59B8262F9A6993E113B888E99EA12314357BE3BA2630EBFA44A5CBD7E729E5820D821CB72A5C1C0C5A59D9893773921F474EC757899644EE7C61341C9058EE352012CEE4840DA9CAC4DF34F5A2F35C222E70EC05859E');
INSERT INTO "fpmatch_entry" VALUES(3,'s3','left','3','/prints/3.tif',X'0303030303030303030303030303030303030303030303030303030303030303',500.0,3,201973295026428,X'894650530D0A1A01F22CE7DAC3D19ADBC6CA731008B0BEDA825E344C9C6C7694914C6DC82BAA7B5BD029B10E5374F2E6F96D1D5000DA5315DE18545C55C3215D5C50FF431122475F899169AB448BD8ABB8606D0D008A5DEC3813873BFE3D3F553EBE9E176DB0798DA10ED6C3DEA5B5E7328B634579243EB7C330F3DDEDBB115D3B48');
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
INSERT INTO "fpmatch_gallery" VALUES(1,4,'539e566ec7d86a84ef5e3292a3a2897e',X'00000000000000004D0E9EE486C50000');
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
INSERT INTO "fpmatch_state" VALUES('4e207e672229a0602680e73f7b0dff30');
INSERT INTO "fpmatch_state" VALUES('539e566ec7d86a84ef5e3292a3a2897e');
INSERT INTO "fpmatch_state" VALUES('c624b83b1688aa1e94daf506b10c95f5');
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
