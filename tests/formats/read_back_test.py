# SPDX-License-Identifier: Apache-2.0
"""Reads the files that `trammel convert` writes with readers of its own: XML and JSON of the Python
standard library, small parsers of the CCSDS keyword-value grammars, and geodesy by plain iteration.

Usage: read_back_test.py PROGRAM
"""

import csv
import datetime
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PROGRAM = ""
SEED_OFFSET = 0.37  # of the sample path, so that no number is round
EPOCH = "2023-11-05T23:59:50.125"
START = datetime.datetime(2023, 11, 5, 23, 59, 50, 125000)
ORIGIN = (-41.25, 174.8, 127.5)  # degrees, metres
UNDULATION_M = 17.25

KML = "{http://www.opengis.net/kml/2.2}"
GX = "{http://www.google.com/kml/ext/2.2}"


def ecef(latitude_deg, longitude_deg, height_m):
    """Earth-fixed position, WGS84."""
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)
    phi, lam = math.radians(latitude_deg), math.radians(longitude_deg)
    n = a / math.sqrt(1 - e2 * math.sin(phi) ** 2)
    return (
        (n + height_m) * math.cos(phi) * math.cos(lam),
        (n + height_m) * math.cos(phi) * math.sin(lam),
        (n * (1 - e2) + height_m) * math.sin(phi),
    )


def axes(latitude_deg, longitude_deg):
    """East, north, up in Earth-fixed axes."""
    phi, lam = math.radians(latitude_deg), math.radians(longitude_deg)
    return (
        (-math.sin(lam), math.cos(lam), 0.0),
        (-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi)),
        (math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi)),
    )


def local(position, origin=ORIGIN):
    """East, north, up of an Earth-fixed position."""
    base = ecef(*origin)
    return [
        sum(axis[i] * (position[i] - base[i]) for i in range(3)) for axis in axes(origin[0], origin[1])
    ]


def parse_time(text):
    """Naive UTC from either ISO form, with or without Z; microseconds."""
    match = re.fullmatch(r"(\d{4})-(?:(\d\d)-(\d\d)|(\d{3}))T(\d\d):(\d\d):(\d\d)(\.\d+)?Z?", text)
    assert match, text
    year, month, day, ordinal, hour, minute, second, fraction = match.groups()
    if ordinal:
        date = datetime.datetime(int(year), 1, 1) + datetime.timedelta(days=int(ordinal) - 1)
    else:
        date = datetime.datetime(int(year), int(month), int(day))
    return date + datetime.timedelta(
        hours=int(hour), minutes=int(minute), seconds=int(second), microseconds=float(fraction or 0) * 1e6
    )


def seconds(text):
    return (parse_time(text) - START).total_seconds()


def sample_path():
    """Rows of a trajectory.csv: a climbing turn of 30 s, tens of kilometres from the origin."""
    rows = []
    for i in range(31):
        t = i * 1.0 + (0.5 if i % 3 == 1 else 0.0)
        phase = 0.05 * t + SEED_OFFSET
        position = (21000 + 3000 * math.cos(phase), -14000 + 3000 * math.sin(phase), 1500 + 4.3 * t)
        velocity = (-150 * math.sin(phase), 150 * math.cos(phase), 4.3)
        rows.append((t, *position, *velocity, 12.5 + 0.1 * t))
    return rows


class ReadBack(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.rows = sample_path()
        names = "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,guaranteed_rms_m"
        lines = [",".join(repr(v) for v in row) for row in self.rows]
        self.write("path.csv", "\n".join([names, *lines]) + "\n")

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def read(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return file.read()

    def convert(self, source, target, *options, code=0):
        result = subprocess.run(
            [PROGRAM, "convert", self.path(source), self.path(target), *options],
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(result.returncode, code, result.stderr + result.stdout)
        return result

    def export(self, target, *options):
        origin = ",".join(str(v) for v in ORIGIN)
        return self.convert("path.csv", target, "--origin=" + origin, "--epoch", EPOCH, *options)

    def assert_close(self, found, expected, tolerance):
        for a, b in zip(found, expected, strict=True):
            self.assertLess(abs(a - b), tolerance, (found, expected))

    def test_kml(self):
        self.export("a.kml", "--geoid-undulation", str(UNDULATION_M), "--object-name", "A <&> B")
        document = xml.etree.ElementTree.fromstring(self.read("a.kml")).find(KML + "Document")
        order = [child.tag for child in document]
        self.assertEqual(
            order, [KML + n for n in ("name", "description", "ExtendedData", "Schema", "Placemark")]
        )
        self.assertEqual(document.find(KML + "name").text, "A <&> B")
        self.assertIn("undulation of 17.25 m", document.find(KML + "description").text)
        stated = document.find(f"{KML}ExtendedData/{KML}Data/{KML}value").text
        track = document.find(f"{KML}Placemark/{GX}Track")
        self.assertEqual(track.find(KML + "altitudeMode").text, "absolute")
        whens = [seconds(e.text) for e in track.findall(KML + "when")]
        coords = [[float(v) for v in e.text.split()] for e in track.findall(GX + "coord")]
        self.assertEqual(len(coords), len(self.rows))
        for row, t, (longitude, latitude, altitude) in zip(self.rows, whens, coords, strict=True):
            self.assertAlmostEqual(t, row[0], delta=1e-6)
            self.assert_close(local(ecef(latitude, longitude, altitude + float(stated))), row[1:4], 1e-6)
        arrays = track.findall(f".//{GX}SimpleArrayData[@name='guaranteed_rms_m']/{GX}value")
        self.assertEqual([float(e.text) for e in arrays], [row[7] for row in self.rows])

    def test_czml(self):
        self.export("a.czml", "--object-id", "X/1")
        packets = json.loads(self.read("a.czml"))
        self.assertEqual((packets[0]["id"], packets[0]["version"]), ("document", "1.0"))
        self.assertEqual(packets[1]["id"], "X/1")
        begin, end = packets[1]["availability"].split("/")
        self.assertEqual(packets[0]["clock"]["interval"], packets[1]["availability"])
        self.assertEqual((seconds(begin), seconds(end)), (self.rows[0][0], self.rows[-1][0]))
        position = packets[1]["position"]
        self.assertEqual(seconds(position["epoch"]), 0.0)
        flat = position["cartographicDegrees"]
        self.assertEqual(len(flat), 4 * len(self.rows))
        for i, row in enumerate(self.rows):
            t, longitude, latitude, height = flat[4 * i : 4 * i + 4]
            self.assertEqual(t, row[0])
            self.assert_close(local(ecef(latitude, longitude, height)), row[1:4], 1e-6)
        number = packets[1]["properties"]["guaranteed_rms_m"]["number"]
        self.assertEqual(number, [v for row in self.rows for v in (row[0], row[7])])

    def test_json(self):
        self.export("a.json")
        data = json.loads(self.read("a.json"))
        self.assertEqual(seconds(data["epoch"]), 0.0)
        origin = data["origin"]
        self.assertEqual((origin["latitude_deg"], origin["longitude_deg"], origin["height_m"]), ORIGIN)
        column = {name: i for i, name in enumerate(data["columns"])}
        for row, found in zip(self.rows, data["rows"], strict=True):
            self.assertEqual(tuple(found[: len(row)]), row)
            place = [found[column[n]] for n in ("latitude_deg", "longitude_deg", "height_m")]
            self.assert_close(local(ecef(*place)), row[1:4], 1e-6)

    def test_oem(self):
        self.export("a.oem", "--object-name", "GLIDER", "--object-id", "X-1", "--originator", "ME")
        lines = self.read("a.oem").splitlines()
        self.assertTrue(all(len(line) <= 254 and line.isascii() for line in lines))
        blocks = "\n".join(line for line in lines if not line.startswith("COMMENT "))
        grammar = re.compile(
            r"CCSDS_OEM_VERS = 2\.0\nCREATION_DATE = (\S+)\nORIGINATOR = ME\nMETA_START\n"
            r"OBJECT_NAME = GLIDER\nOBJECT_ID = X-1\nCENTER_NAME = EARTH\nREF_FRAME = ITRF2000\n"
            r"TIME_SYSTEM = UTC\nSTART_TIME = (\S+)\nSTOP_TIME = (\S+)\n"
            r"INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 3\nMETA_STOP\n((?:\S+(?: \S+){6}\n?)+)"
        )
        match = grammar.fullmatch(blocks)
        self.assertIsNotNone(match, blocks[:600])
        creation, start, stop, body = match.groups()
        parse_time(creation)
        self.assertEqual((seconds(start), seconds(stop)), (self.rows[0][0], self.rows[-1][0]))
        rotation = axes(ORIGIN[0], ORIGIN[1])
        for row, line in zip(self.rows, body.splitlines(), strict=True):
            words = line.split(" ")
            self.assertAlmostEqual(seconds(words[0]), row[0], delta=1e-6)
            numbers = [1000 * float(word) for word in words[1:]]
            self.assert_close(local(numbers[:3]), row[1:4], 1e-6)
            velocity = [sum(axis[i] * numbers[3 + i] for i in range(3)) for axis in rotation]
            self.assert_close(velocity, row[4:7], 1e-9)

    def read_tdm(self, name):
        """Segments of a message, each ({keyword: value}, [(keyword, t_s, number)])."""
        header, *segments = re.split(r"^META_START$", self.read(name), flags=re.M)
        keys = [l.split(" = ")[0] for l in header.splitlines() if l and not l.startswith("COMMENT")]
        self.assertEqual(keys, ["CCSDS_TDM_VERS", "CREATION_DATE", "ORIGINATOR"])
        order = (
            "TIME_SYSTEM START_TIME STOP_TIME PARTICIPANT_1 PARTICIPANT_2 MODE PATH TIMETAG_REF "
            "RANGE_UNITS ANGLE_TYPE"
        ).split()
        result = []
        for segment in segments:
            match = re.fullmatch(r"\n(.*?)META_STOP\nDATA_START\n(.*?)DATA_STOP\n", segment, flags=re.S)
            self.assertIsNotNone(match, segment)
            metadata = dict(line.split(" = ") for line in match.group(1).splitlines())
            positions = [order.index(key) for key in metadata]
            self.assertEqual(positions, sorted(positions))
            records = []
            for line in match.group(2).splitlines():
                keyword, tag, number = re.fullmatch(r"([A-Z_12]+) = (\S+) (\S+)", line).groups()
                records.append((keyword, seconds(tag), float(number)))
            for keyword in {r[0] for r in records}:
                times = [r[1] for r in records if r[0] == keyword]
                self.assertEqual(times, sorted(set(times)))
            result.append((metadata, records))
        return result

    def test_tdm(self):
        self.write(
            "wide.csv",
            "t_s,radar.azimuth_rad,radar.elevation_rad,radar.range_m,dme.range_m,doppler.range_rate_mps\n"
            "0.1,6.2,0.3,42500.25,,-120.5\n4.1,-0.2,0.31,42000,39000.5,\n12.75,,,,38000,\n",
        )
        self.convert("wide.csv", "a.tdm", "--epoch", EPOCH, "--target", "AIRCRAFT")
        segments = {m["PARTICIPANT_1"]: (m, r) for m, r in self.read_tdm("a.tdm")}
        self.assertEqual(set(segments), {"radar", "dme", "doppler"})
        metadata, records = segments["radar"]
        self.assertEqual(metadata["PARTICIPANT_2"], "AIRCRAFT")
        self.assertEqual((metadata["RANGE_UNITS"], metadata["ANGLE_TYPE"]), ("km", "AZEL"))
        self.assertEqual((metadata["MODE"], metadata["PATH"]), ("SEQUENTIAL", "1,2,1"))
        expected = [
            ("ANGLE_1", 0.1, math.degrees(6.2)),
            ("ANGLE_2", 0.1, math.degrees(0.3)),
            ("RANGE", 0.1, 42.50025),
            ("ANGLE_1", 4.1, math.degrees(-0.2)),
            ("ANGLE_2", 4.1, math.degrees(0.31)),
            ("RANGE", 4.1, 42.0),
        ]
        for found, wanted in zip(records, expected, strict=True):
            self.assertEqual(found[0], wanted[0])
            self.assert_close(found[1:], wanted[1:], 1e-6 if found[0] != "RANGE" else 1e-12 + 1e-6)
        self.assertEqual([r[2] for r in segments["dme"][1]], [39.0005, 38.0])
        self.assertEqual([r[2] for r in segments["doppler"][1]], [-0.1205])

        self.convert("a.tdm", "back.csv", "--epoch", EPOCH)
        lines = [line for line in self.read("back.csv").splitlines() if not line.startswith("#")]
        rows = list(csv.DictReader(lines))
        self.assertEqual([float(r["t_s"]) for r in rows], [0.1, 4.1, 12.75])
        self.assertAlmostEqual(float(rows[0]["radar.azimuth_rad"]), 6.2, delta=1e-14)
        self.assertAlmostEqual(float(rows[0]["radar.range_m"]), 42500.25, delta=1e-10)
        self.assertEqual((rows[2]["radar.range_m"], float(rows[2]["dme.range_m"])), ("", 38000.0))

        self.convert("a.tdm", "long.csv", "--epoch", EPOCH, "--form", "long")
        kinds = ["radar=azimuth_elevation_range", "dme=range", "doppler=range_rate"]
        options = [word for kind in kinds for word in ("--kind", kind)]
        self.convert("long.csv", "b.tdm", "--epoch", EPOCH, "--target", "AIRCRAFT", *options)
        again = {m["PARTICIPANT_1"]: (m, r) for m, r in self.read_tdm("b.tdm")}
        self.assertEqual(again["radar"], segments["radar"])

    def test_igc(self):
        self.write(
            "a.igc",
            "AXXX\nHFDTE051123\n"
            "B2359584114500S17450000EA0090001010\n"
            "B2359594114600S17450100EV0090000000\n"
            "B0000014114700S17450300EA0095001060\n",
        )
        origin = ",".join(str(v) for v in ORIGIN)
        result = self.convert("a.igc", "a.csv", "--origin=" + origin, "--geoid-undulation", "17.25", "--json")
        summary = json.loads(result.stdout)
        self.assertEqual((summary["rows"], summary["epoch"]), (2, "2023-11-05T23:59:58Z"))
        self.assertEqual(summary["origin"]["longitude_deg"], ORIGIN[1])
        self.assertEqual(summary["notes"], ["left out 1 invalid fixes"])
        lines = self.read("a.csv").splitlines()
        self.assertIn("latitude -41.25 deg, longitude 174.8 deg, height 127.5 m", lines[0])
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        self.assertEqual([float(r["t_s"]) for r in rows], [0.0, 3.0])
        for row, latitude, longitude, height in (
            (rows[0], -41 - 14.5 / 60, 174 + 50.0 / 60, 1010 + 17.25),
            (rows[1], -41 - 14.7 / 60, 174 + 50.3 / 60, 1060 + 17.25),
        ):
            found = [float(row[n]) for n in ("x_m", "y_m", "z_m")]
            self.assert_close(found, local(ecef(latitude, longitude, height)), 1e-6)
        self.convert("a.igc", "a.kml", "--geoid-undulation", "17.25")
        coords = [e.text for e in xml.etree.ElementTree.fromstring(self.read("a.kml")).iter(GX + "coord")]
        self.assertAlmostEqual(float(coords[1].split()[2]), 1060, delta=1e-6)

    def test_bad_input(self):
        self.write("empty.csv", "")
        self.write("times.csv", "t_s,x_m,y_m,z_m\n0,1,2,3\n0,1,2,3\n")
        self.write("nan.csv", "t_s,x_m,y_m,z_m\n0,1,nan,3\n")
        self.write("other.csv", "t_s,x_m,y_m,z_m,w\n0,1,2,3,4\n")
        self.write("long.csv", "t_s,station,y1\n0,a,5\n")
        self.write("bad.tdm", "CCSDS_TDM_VERS = 2.0\nMETA_START\nTIME_SYSTEM UTC\n")
        self.write("bad.igc", "HFDTE010101\nB2359584114500S17450000EA00900010\n")
        place = ["--origin=1,2", "--epoch", EPOCH]
        for source, target, options, message in (
            ("absent.csv", "a.kml", place, "absent.csv"),
            ("empty.csv", "a.kml", place, "empty.csv: found an empty file"),
            ("times.csv", "a.kml", place, "times.csv:3: column 't_s': found 0 after 0"),
            ("nan.csv", "a.kml", place, "nan.csv:2: column 'y_m': found 'nan'"),
            ("other.csv", "a.kml", place, "found an unknown column 'w'"),
            ("path.csv", "a.kml", ["--epoch", EPOCH], "--origin: found nothing"),
            ("path.csv", "a.kml", ["--origin=1,2"], "--epoch: found nothing"),
            ("path.csv", "a.kml", ["--origin=1,2,3,4", "--epoch", EPOCH], "--origin: found '1,2,3,4'"),
            ("path.csv", "a.kml", ["--origin=1", "--epoch", EPOCH], "--origin: found '1'"),
            ("path.csv", "a.kml", ["--origin=91,2", "--epoch", EPOCH], "latitude: found 91"),
            ("path.csv", "a.kml", ["--origin=1,2", "--epoch", "now"], "--epoch: found 'now'"),
            ("path.csv", "a.kml", [*place, "--form", "long"], "--form: found an option"),
            ("path.csv", "a.xyz", place, "found '.csv' to '.xyz'"),
            ("times.csv", "a.tdm", ["--epoch", EPOCH], "times.csv"),
            ("long.csv", "a.tdm", ["--epoch", EPOCH], "--kind: found nothing"),
            ("long.csv", "a.tdm", ["--epoch", EPOCH, "--kind", "a=radar"], "--kind: found 'a=radar'"),
            ("long.csv", "a.tdm", ["--epoch", EPOCH, "--kind", "b=range"], "long.csv:2: column 'station'"),
            ("bad.tdm", "a.csv", [], "bad.tdm:3: found 'TIME_SYSTEM UTC'"),
            ("bad.igc", "a.csv", [], "bad.igc:2: B record"),
            ("path.csv", "a.kml", [*place, "--geoid-undulation", "nan"], "--geoid-undulation"),
        ):
            with self.subTest(source=source, options=options):
                result = self.convert(source, target, *options, code=2)
                self.assertIn(message, result.stderr)
                self.assertFalse(os.path.exists(self.path(target)))


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main(verbosity=2)
