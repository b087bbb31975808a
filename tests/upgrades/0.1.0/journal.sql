BEGIN TRANSACTION;
CREATE TABLE jobs (
    job_id INTEGER PRIMARY KEY CHECK (job_id > 0),
    taken_at TEXT NOT NULL,
    trigger_kind TEXT NOT NULL,
    trigger_session INTEGER,
    trigger_counter INTEGER,
    recipe INTEGER NOT NULL,
    thickness_um INTEGER NOT NULL,
    session INTEGER,
    pages TEXT,
    withdraw_reason INTEGER,
    outcome TEXT CHECK (outcome IN ('accepted', 'written', 'refused', 'failed')),
    reason INTEGER,
    detail TEXT,
    settled_at TEXT,
    report TEXT,
    recipe_digest TEXT,
    calibration TEXT,
    transfer TEXT
) STRICT;
INSERT INTO "jobs" VALUES(1,'2026-11-23T20:36:35.025+00:00','controller',40917,1,1,0,40917,NULL,NULL,'accepted',NULL,NULL,'2026-11-23T20:36:35.252+00:00','{"frame": "/srv/cell/pictures/0.png", "frame_ms": 6.9, "method": "wall-tips", "polarity": "bright", "pitch_px": 14.795, "vertices": 4, "area_mm2": 7205.177, "uncertainty_mm": 0.343, "thickness_mm": 20.0, "timings_ms": {"mask": 121.254, "trace": 59.695, "quality": 3.628, "convert": 0.497, "simplify": 1.079, "judge": 0.672, "guard": 0.041, "total": 186.866}, "pages_ms": 0.4, "transfer_ms": 29.9, "total_ms": 224.9}','e8ea8429bd48e179386c6d8afd992445845199456e657366f15eb6553e276d4e','sha256:383931850f4cc47376d0c0b66dcb85a2e67f4d3ded775126308d0f8743645469','{"session": 40917, "captured_at": 3004, "pages": 1, "registers": 49, "crc32": ["2D0172A9"]}');
INSERT INTO "jobs" VALUES(2,'2026-11-23T20:36:38.065+00:00','controller',40917,2,1,0,40917,NULL,NULL,'refused',151,'answer 7 operator_refused','2026-11-23T20:36:38.189+00:00','{"frame": "/srv/cell/pictures/1.png", "frame_ms": 3.4, "method": "wall-tips", "polarity": "bright", "pitch_px": 14.846, "vertices": 4, "area_mm2": 8923.158, "uncertainty_mm": 0.265, "thickness_mm": 20.0, "timings_ms": {"mask": 20.168, "trace": 65.958, "quality": 2.565, "convert": 0.65, "simplify": 2.134, "judge": 0.531, "guard": 0.042, "total": 92.049}, "pages_ms": 0.3, "transfer_ms": 17.8, "total_ms": 115.4}','e8ea8429bd48e179386c6d8afd992445845199456e657366f15eb6553e276d4e','sha256:383931850f4cc47376d0c0b66dcb85a2e67f4d3ded775126308d0f8743645469','{"session": 40917, "captured_at": 6053, "pages": 1, "registers": 49, "crc32": ["59BBBB6C"]}');
INSERT INTO "jobs" VALUES(3,'2026-11-23T20:36:41.068+00:00','controller',40917,3,2,0,NULL,NULL,NULL,'refused',112,'The contour''s area is 7756 mm², the recipe expects 100000 to 4000000 mm². Check that the block is the recipe''s, and the lighting.','2026-11-23T20:36:41.173+00:00','{"frame": "/srv/cell/pictures/2.png", "frame_ms": 0.9, "method": "wall-tips", "polarity": "bright", "pitch_px": 14.739, "vertices": 4, "area_mm2": 7755.541, "uncertainty_mm": 0.324, "thickness_mm": 20.0, "timings_ms": {"mask": 21.504, "trace": 67.925, "quality": 2.124, "convert": 0.226, "simplify": 3.678, "judge": 0.54, "guard": 0.05, "total": 96.046}, "total_ms": 98.1}','a1a7f1ecac8f50600985e31109ada9d66686266591e44f9acb1f9ca585bc9193','sha256:383931850f4cc47376d0c0b66dcb85a2e67f4d3ded775126308d0f8743645469',NULL);
INSERT INTO "jobs" VALUES(4,'2026-11-23T20:36:46.307+00:00','controller',40918,1,1,0,40918,'0001000000040001000100010012cc151e1900000004000073edfffe75bf0001fce5ffffb56600001c250000015700000bdb00010005000075309fd600010000000400008869ffffb566000073edfffe8fc50001e874fffe75bf0001fce5ffff9b8d',NULL,NULL,NULL,NULL,NULL,NULL,'e8ea8429bd48e179386c6d8afd992445845199456e657366f15eb6553e276d4e','sha256:383931850f4cc47376d0c0b66dcb85a2e67f4d3ded775126308d0f8743645469',NULL);
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
INSERT INTO "meta" VALUES('owner','15430');
INSERT INTO "meta" VALUES('above','0');
INSERT INTO "meta" VALUES('otherwise_from','1');
CREATE TABLE recipe_settings (digest TEXT PRIMARY KEY, settings TEXT NOT NULL) STRICT;
INSERT INTO "recipe_settings" VALUES('e8ea8429bd48e179386c6d8afd992445845199456e657366f15eb6553e276d4e','{"binarize": "flat", "edge": "cut", "max_area_mm2": 4000000.0, "max_disagreement_pitches": 2.0, "max_uncertainty_mm": 0.0, "max_vertices": 4000, "method": "wall-tips", "min_area_mm2": 100.0, "name": "default", "number": 1, "parameters": {}, "pieces": "one", "polarity": "auto", "roi_mm": [], "roi_px": [], "thickness_mm": 20.0, "thickness_tolerance_mm": 0.0, "tolerance_mm": 0.1}');
INSERT INTO "recipe_settings" VALUES('a1a7f1ecac8f50600985e31109ada9d66686266591e44f9acb1f9ca585bc9193','{"binarize": "flat", "edge": "cut", "max_area_mm2": 4000000.0, "max_disagreement_pitches": 2.0, "max_uncertainty_mm": 0.0, "max_vertices": 4000, "method": "wall-tips", "min_area_mm2": 100000.0, "name": "large", "number": 2, "parameters": {}, "pieces": "one", "polarity": "auto", "roi_mm": [], "roi_px": [], "thickness_mm": 20.0, "thickness_tolerance_mm": 0.0, "tolerance_mm": 0.1}');
CREATE INDEX jobs_unsettled ON jobs (job_id) WHERE outcome IS NULL;
CREATE INDEX jobs_by_controller ON jobs (job_id) WHERE trigger_counter IS NOT NULL;
COMMIT;
PRAGMA user_version = 2;
