"""Logs as strangers' recorders write them: one zigzag in all of their forms."""

import json
import struct
import sys
from datetime import UTC, datetime
from functools import reduce

import numpy as np
import pytest

from shipgym import InputError, Trial
from shipgym.trials.guesses import guess_trial
from shipgym.trials.units import DEGREE, KNOT
from tests.shipgym.one_zigzag import SPEED, sailed

BEGIN = datetime(2021, 5, 3, 9, 59, 50, tzinfo=UTC).timestamp()


def sentence(text):
    return f"${text}*{reduce(lambda a, b: a ^ b, map(ord, text)):02X}"


def clock(t, form="%H%M%S", begin=BEGIN):
    return datetime.fromtimestamp(begin + t, UTC).strftime(form)


def place(one):
    lat, lon = one.lat % 1 * 60.0, one.lon % 1 * 60.0
    return f"{int(one.lat):02d}{lat:08.5f},N,{int(one.lon):03d}{lon:08.5f},E"


def rmc(one, variation="", begin=BEGIN):
    course = one.course % 360.0
    at, date = clock(one.t, begin=begin), clock(one.t, "%d%m%y", begin)
    speed = one.speed / KNOT
    return (
        f"GPRMC,{at}.00,A,{place(one)},{speed:.2f},{course:.2f},{date},"
        f"{variation or ','},A"
    )


def gll(one, begin=BEGIN):
    return f"GPGLL,{place(one)},{clock(one.t, begin=begin)}.00,A,A"


def zda(one):
    return f"GPZDA,{clock(one.t)}.00,{clock(one.t, '%d,%m,%Y')},00,00"


def hdt(one, talker="HE"):
    return f"{talker}HDT,{one.psi % 360.0:.2f},T"


def rsa(one, fields="{:.1f},A,,", talker="AG"):
    return f"{talker}RSA,{fields.format(one.rudder)}"


def plain(*kinds):
    """Lines of these sentences for every second."""
    return [sentence(kind(one)) for one in sailed() for kind in kinds]


def stamped(form, *kinds):
    """Lines of these sentences, each after what a recorder writes before it."""
    return [
        form(one, number) + sentence(kind(one))
        for one in sailed()
        for number, kind in enumerate(kinds)
    ]


def read(tmp_path, lines, name="log.nmea", end="\r\n"):
    path = tmp_path / name
    content = (end.join(lines) + end).encode()
    path.write_bytes(content)
    return guess_trial(path).trial


def assert_as_sailed(trial, step=1.0, rows=240, turned=0.0, kept=slice(None)):
    """Heading, rudder and speed are those of the ship, row by row."""
    truth = sailed(rows, step)
    t = np.array([one.t for one in truth])[kept]
    assert t.size - 1 <= len(trial) <= t.size
    since = trial.t + t[0]
    psi = np.interp(since, t, [one.psi for one in truth][kept])
    error = trial["psi"] / DEGREE - psi - turned
    error -= 360.0 * np.round(error / 360.0)
    assert np.sqrt(np.mean(error**2)) < 0.25
    delta = np.interp(since, t, [one.rudder for one in truth][kept])
    assert np.sqrt(np.mean((trial["delta"] / DEGREE - delta) ** 2)) < 0.3
    if "u" in trial and not turned:
        assert np.abs(trial["u"] - SPEED)[2:-2].max() < 0.1


def assert_said(trial, *words):
    for word in words:
        assert any(word in note for note in trial.notes), (word, trial.notes)


def hdm(one):
    return f"HCHDM,{(one.psi - 16.0) % 360.0:.2f},M"


def hdg(one):
    return f"HCHDG,{(one.psi - 16.0) % 360.0:.2f},,,,"


def rmc_varied(one):
    return rmc(one, "16.0,E")


def half_past(one, _):
    return clock(one.t, "%Y-%m-%d %H:%M:%S.500 ", BEGIN + 7200)


STAMPS = {
    "dated": lambda one, k: clock(one.t, "%Y-%m-%d %H:%M:%S.") + f"{k:03d} ",
    "german": lambda one, k: clock(one.t, "%d.%m.%Y %H:%M:%S,") + f"{k:03d}\t",
    "of the day": lambda one, k: clock(one.t, "[%H:%M:%S] "),
    "milliseconds": lambda one, k: f"{1000 * (BEGIN + one.t):.0f};A;",
    "candump": lambda one, k: f"({BEGIN + one.t:.6f}) ",
    "tag": lambda one, k: f"\\s:gyro,c:{BEGIN + one.t:.0f}*00\\",
    "since the start": lambda one, k: f"{one.t + 0.001 * k:.3f} ",
    "zone": lambda one, k: clock(one.t, "%Y-%m-%dT%H:%M:%S+02:00 ", BEGIN + 7200),
}


@pytest.mark.parametrize("kinds", [(rmc, hdt, rsa), (hdt, rsa)])
@pytest.mark.parametrize("stamp", STAMPS)
def test_times_before_the_lines_are_a_clock(stamp, kinds, tmp_path):
    assert_as_sailed(read(tmp_path, stamped(STAMPS[stamp], *kinds), "log.txt"))


def test_a_recorder_in_another_zone_keeps_its_clock(tmp_path):
    assert_as_sailed(read(tmp_path, stamped(half_past, rmc, hdt, rsa)))
    reading = guess_trial(tmp_path / "log.nmea").reading
    assert reading["t"] == "stamps of the lines"


def test_a_recorder_that_writes_in_blocks_takes_the_time_of_the_satellites(tmp_path):
    def late(one, _):
        return clock(one.t // 9 * 9 + 9 * (one.t % 31 > 15), "%Y-%m-%d %H:%M:%S ")

    trial = read(tmp_path, stamped(late, rmc, hdt, rsa))
    assert_as_sailed(trial)
    assert_said(trial, "before the lines do not run with those of GPRMC: left out")


@pytest.mark.parametrize(("name", "end"), [("log.txt", "\n"), ("a.csv", "\r")])
def test_the_name_of_a_file_and_its_ends_of_lines_do_not_matter(name, end, tmp_path):
    assert_as_sailed(read(tmp_path, plain(rmc, hdt, rsa), name, end))


@pytest.mark.parametrize(
    ("kinds", "words"),
    [
        (
            (rmc_varied, hdm, rsa),
            ["HCHDM with the variation of GPRMC added, 16.0 deg E"],
        ),
        ((rmc_varied, hdg, rsa), ["HCHDG with the variation of GPRMC"]),
        ((rmc, lambda one: hdg(one)[:-4] + ",,,16.0,E", rsa), []),
        ((rmc_varied, hdg, hdt, rsa), ["psi is from HEHDT (240 values); HCHDG"]),
        (
            (rmc, hdt, lambda one: rsa(one, ",V,{:.1f},A")),
            [],
        ),
        ((rmc, hdt, lambda one: rsa(one, "{:.1f},,,")), ["status in 240 sentences"]),
        (
            (rmc, hdt, lambda one: rsa(one, "0.0,A,{:.1f},A")),
            ["delta is from AGRSA port (240 values); AGRSA (240 values) left out"],
        ),
        (
            (rmc, hdt, rsa, lambda one: rsa(one, talker="II")),
            ["IIRSA (240 values) left"],
        ),
        ((rmc, hdt, lambda one: f"IIXDR,A,{one.rudder:.1f},D,RUDDER"), []),
        ((gll, lambda one: hdt(one, "GP"), lambda one: rsa(one, talker="SD")), []),
        ((zda, hdt, rsa), ["no speed is known"]),
    ],
)
def test_what_sentences_hold_is_read(kinds, words, tmp_path):
    trial = read(tmp_path, plain(*kinds))
    assert_as_sailed(trial)
    assert_said(trial, *words)


def test_a_heading_that_stays_magnetic_says_so_until_the_variation_is_given(tmp_path):
    trial = read(tmp_path, plain(rmc, hdm, rsa))
    assert_as_sailed(trial, turned=-16.0)
    assert_said(trial, "the heading stays magnetic")
    assert trial.magnetic

    turned = {"variation_deg": 16.0}
    trial = Trial.from_csv(tmp_path / "log.nmea", sensors=turned)
    assert_as_sailed(trial)
    assert not trial.magnetic
    assert not any("magnetic" in note for note in trial.notes)


def test_sentences_without_checksums_are_read(tmp_path):
    lines = [line[:-3] for line in plain(rmc, hdt, rsa)]
    lines[301] = lines[301][:9]  # cut short
    trial = read(tmp_path, lines)
    assert_as_sailed(trial)
    assert_said(
        trial, "719 of 720 sentences have no checksum", "1 of 720 sentences with a"
    )


def test_a_faster_gyro_is_spread_over_the_second(tmp_path):
    fast = sailed(1200, 0.2)
    lines = []
    for k, one in enumerate(fast):
        if k % 5 == 0:
            lines += [sentence(rmc(one)), sentence(rsa(one))]
        lines.append(sentence(hdt(one)))
    path = tmp_path / "log.nmea"
    path.write_text("\n".join(lines))
    assert_as_sailed(
        guess_trial(path).trial, step=0.2, rows=1200, kept=slice(None, None, 5)
    )


def test_a_clock_that_is_set_back_is_named(tmp_path):
    lines = plain(rmc, hdt, rsa)
    with pytest.raises(InputError, match="line 451: expected time to go on, got one"):
        read(tmp_path, lines[:450] + lines[300:])


def delta(one, values, context="vessels.self", of="$source"):
    source = "gyro" if of == "$source" else {"label": "n2k", "src": "3", "pgn": 127250}
    update = {
        "timestamp": clock(one.t, "%Y-%m-%dT%H:%M:%S.000Z"),
        of: source,
        "values": [{"path": path, "value": value} for path, value in values.items()],
    }
    return json.dumps({"context": context, "updates": [update]})


def deltas(one, **settings):
    heading = "navigation.headingTrue"
    position = {"latitude": one.lat, "longitude": one.lon}
    course = {
        "navigation.speedOverGround": one.speed,
        "navigation.courseOverGroundTrue": one.course * DEGREE,
        "navigation.position": position,
    }
    return [
        delta(one, {heading: one.psi % 360 * DEGREE}, **settings),
        delta(one, {"steering.rudderAngle": one.rudder * DEGREE}, **settings),
        delta(one, course, **settings),
    ]


@pytest.mark.parametrize("of", ["$source", "source"])
def test_deltas_of_signal_k_are_read_and_other_vessels_left_out(of, tmp_path):
    own, other = "vessels.urn:mrn:imo:mmsi:230099999", "vessels.urn:mrn:imo:mmsi:1"
    lines = []
    for one in sailed():
        lines += deltas(one, context=own, of=of)
        lines += deltas(one._replace(psi=10.0), context=other)[2:] * 4
    trial = read(tmp_path, lines, "log.jsonl")
    assert_as_sailed(trial)
    assert_said(trial, f"960 deltas of other vessels than {own} left out")


# --- NMEA 2000


def pgns(one, magnetic=False):
    """Payloads of rudder, heading, rate of turn, position, course and speed."""
    psi = (one.psi - 16.0 * magnetic) % 360.0 * DEGREE
    course = one.course % 360.0 * DEGREE
    lat, lon = round(one.lat * 1e7), round(one.lon * 1e7)
    frames = {
        127245: struct.pack(
            "<BBhhH", 0, 0xF8, 0x7FFF, round(one.rudder * DEGREE * 1e4), 0xFFFF
        ),
        127250: struct.pack(
            "<BHhhB", 1, round(psi * 1e4), 0x7FFF, 0x7FFF, 0xFC + magnetic
        ),
        127251: struct.pack("<BiBH", 1, round(one.r * DEGREE / 3.125e-8), 0xFF, 0xFFFF),
        129025: struct.pack("<ii", lat, lon),
        129026: struct.pack(
            "<BBHHH", 1, 0xFC, round(course * 1e4), round(one.speed * 100), 0xFFFF
        ),
    }
    if magnetic:
        frames[127258] = struct.pack(
            "<BBHhH", 1, 0xF4, 0xFFFF, round(16 * DEGREE * 1e4), 0xFFFF
        )
    return frames


def can_id(pgn):
    return f"{0x08000000 | pgn << 8 | 0x23:08X}"


def candump(t, pgn, data):
    return f"({BEGIN + t:.6f}) can0 {can_id(pgn)}#{data.hex().upper()}"


def candump_shown(t, pgn, data):
    return f" ({BEGIN + t:.6f})  can0  {can_id(pgn)}   [8]  {data.hex(' ').upper()}"


def yacht_devices(t, pgn, data):
    at = clock(t, "%H:%M:%S.000")
    return f"{at} R {can_id(pgn)} {data.hex(' ').upper()}"


def actisense(t, pgn, data):
    return f"A{35990 + t:010.3f} 23FF2 {pgn:05X} {data.hex().upper()}"


def canboat_plain(t, pgn, data):
    at = clock(t, "%Y-%m-%dT%H:%M:%S.000Z")
    return f"{at},2,{pgn},35,255,8,{data.hex(',')}"


@pytest.mark.parametrize("magnetic", [False, True])
@pytest.mark.parametrize(
    "form",
    [candump, candump_shown, yacht_devices, actisense, canboat_plain],
)
def test_raw_frames_of_nmea_2000_are_decoded(form, magnetic, tmp_path):
    pytest.importorskip("nmea2000", reason="needs the extra nmea2000")
    lines = [
        form(one.t, pgn, data)
        for one in sailed()
        for pgn, data in pgns(one, magnetic).items()
    ]
    trial = read(tmp_path, lines, "log.txt")
    assert_as_sailed(trial)
    assert "r" not in trial.derived
    if magnetic:
        assert_said(trial, "with the variation of PGN 127258 of 35 added, 16.0 deg E")


def test_raw_frames_without_their_package_are_one_message(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "nmea2000.decoder", None)
    lines = [candump(0.0, 127245, bytes(8))] * 3
    with pytest.raises(
        InputError, match=r"log.nmea.*pip install 'shipgym\[nmea2000\]'"
    ):
        read(tmp_path, lines)


def analyzed(one):
    """Fields of messages as canboat's analyzer prints them."""
    return {
        (127245, "Rudder"): {"Instance": 0, "Position": round(one.rudder, 4)},
        (127250, "Vessel Heading"): {
            "SID": 1,
            "Heading": round(one.psi % 360, 4),
            "Reference": "True",
        },
        (129025, "Position, Rapid Update"): {
            "Latitude": round(one.lat, 7),
            "Longitude": round(one.lon, 7),
        },
        (129026, "COG & SOG, Rapid Update"): {
            "COG Reference": "True",
            "COG": round(one.course % 360, 4),
            "SOG": round(one.speed, 2),
        },
    }


def as_json(one):
    at = clock(one.t, "%Y-%m-%d-%H:%M:%S.120")
    for (pgn, name), fields in analyzed(one).items():
        content = {"timestamp": at, "prio": 2, "src": 204, "dst": 255, "pgn": pgn}
        yield json.dumps(content | {"description": name, "fields": fields})


def test_what_canboat_prints_is_read(tmp_path):
    lines = ["INFO 2025-12-16T17:22:41.995Z [analyzer] New PGN 127245 for device 127"]
    for one in sailed():
        lines += as_json(one)
    assert_as_sailed(read(tmp_path, lines, "analyzed.txt"))


# --- what can only be looked at


def test_a_log_of_ais_is_named(tmp_path):
    lines = ["!AIVDM,1,1,,B,13u=gHP3CWPlvs2Q8sHW:5fD0h6a,0*1B"] * 9
    with pytest.raises(InputError, match="this looks like a log of AIS"):
        read(tmp_path, lines)
