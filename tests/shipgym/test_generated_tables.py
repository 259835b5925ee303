"""Tables of twenty recorders with changing units, times and faults, read right."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from shipgym.trials.guesses import guess_trial
from shipgym.trials.units import DEGREE, KNOT
from tests.shipgym.one_zigzag import sailed

#: Names of time, heading, rudder, speed and position, with the unit where it is named.
RECORDERS = """\
Time [s];Heading [deg];Rudder [deg];SOG [kn];Lat;Lon
timestamp;yaw;rudder_angle;speed;latitude;longitude
UTC;HDT;RSA;STW;POS N;POS E
t;GYRO HDG;rud_fb;log STW;GPS lat;GPS lon
Zeit;Kurs;Ruder;Fahrt;Breite;Länge
ts;nav.heading;steering.rudder;nav.speed;nav.lat;nav.lon
Uhrzeit;Steuerkurs [°];Ruderlage [°];FdW [kn];Breite;Länge
Heure;Cap;Barre;Vitesse;Latitude;Longitude
Hora;Rumbo;Timón;Velocidad;Latitud;Longitud
header.stamp;pose.heading;RudFB;twist.linear.x;fix.latitude;fix.longitude
time_s;psi_deg;delta_deg;u_m_s;lat;lon
Tijd;Koers;Roer;Vaart;Breedte;Lengte
RecTime;Hdg True;rud_act;Speed thr. water [kn];GPS_Lat;GPS_Lng
DateTime;Gyro;Rud.FB;Log Speed;LAT;LON
time;ATT.Yaw;STEER.angle;GPS.Spd;GPS.Lat;GPS.Lng
時刻;船首方位;舵角;速力;緯度;経度
Time (UTC);Ship Heading;Rudder Angle;Ship Speed;Latitude;Longitude
Tid;Kurs;Rorvinkel;Fart;Bredde;Lengde
elapsed_time;compass_heading;helm;boat_speed;lat;lng
navigation.datetime;navigation.headingTrue;steering.rudderAngle;navigation.speedThroughWater;x;y
""".splitlines()
START = datetime(2024, 5, 31, 9, 30)
TIMES = {
    "s": lambda t: f"{t:.1f}",
    "unix": lambda t: f"{1717147800 + t:.1f}",
    "ms": lambda t: f"{1717147800000 + 1000 * t:.0f}",
    "iso": lambda t: (START + timedelta(seconds=t)).isoformat(),
    "day first": lambda t: f"{START + timedelta(seconds=t):%d.%m.%Y %H:%M:%S}",
    "of day": lambda t: f"{START + timedelta(seconds=t):%H:%M:%S}",
}


def choose(rng, options):
    return options[rng.integers(len(options))]


def columns_of(rng, names):
    """Texts of each column, and the sign of the rudder."""
    ship = sailed(240)
    is_si = "navigation" in names[1]
    angle = DEGREE if is_si or ("deg" not in names[1] and rng.random() < 0.2) else 1.0
    named = [one for one in ("kn", "m_s", "Through") if one in names[3]]
    factor = KNOT if named == ["kn"] else 1.0
    if not named:
        factor = choose(rng, (KNOT, 1.0, 1 / 3.6))
    sign = choose(rng, (1.0, -1.0))
    noise = 0.05 * rng.standard_normal((2, len(ship)))
    time = TIMES[
        "s" if "[s]" in names[0] or "_s" in names[0] else choose(rng, [*TIMES])
    ]
    psi = (np.array([one.psi for one in ship]) + noise[0]) % 360.0
    rudder = sign * np.array([one.rudder for one in ship]) + noise[1]
    form = "{:.5f}" if angle != 1.0 else choose(rng, ("{:.1f}", "{:.2f}"))
    return sign, [
        [time(one.t) for one in ship],
        [form.format(angle * one) for one in psi],
        [form.format(angle * one) for one in rudder],
        [f"{one.speed / factor:.2f}" for one in ship],
        [f"{one.lat:.6f}" for one in ship],
        [f"{one.lon:.6f}" for one in ship],
    ]


def written(seed):
    """Text of a table, and the sign of its rudder."""
    rng = np.random.default_rng(seed)
    names = RECORDERS[seed % len(RECORDERS)].split(";")
    sign, columns = columns_of(rng, names)
    names += ["Depth", "Note"]
    columns += [[f"{30 + rng.normal():.1f}" for _ in columns[0]], ["ok"] * 240]
    if names[4] == "x" or rng.random() < 0.3:
        del names[4:6], columns[4:6]
    fault = choose(rng, ("", "", "dashes", "footer", "title", "sentinel", "spliced"))
    for row in rng.integers(5, 230, 6):
        if fault == "dashes":
            columns[1][row] = "---"
        if fault == "sentinel":
            columns[1][row] = "9999"
    order = rng.permutation(len(names))
    delimiter = choose(rng, (",", ";", "\t"))
    rows = [delimiter.join(columns[k][row] for k in order) for row in range(240)]
    if fault == "spliced":
        rows += rows[:200]
    if fault == "footer":
        rows.append(delimiter.join(["Mean", *["1.0"] * (len(names) - 1)]))
    lines = [delimiter.join(names[k] for k in order), *rows]
    if fault == "title":
        lines = ["Sea trial", "", *lines]
    text = "\n".join(lines)
    return text.replace(".", ",") if delimiter == ";" and "x" in fault else text, sign


def wrong_in_silence(guess, sign):
    """What was read otherwise than sailed without a question."""
    trial = guess.trial
    if trial is None or guess.decisions:
        return ""
    ship = sailed(240)
    t = np.array([one.t for one in ship])
    first = trial.t <= trial.t[0] + 239.5
    truth = {"psi": [one.psi for one in ship], "delta": [one.rudder for one in ship]}
    for name, values in truth.items():
        expected = np.interp(trial.t[first] - trial.t[0], t, values)
        apart = np.degrees(trial[name][first]) - expected if name in trial else np.nan
        apart = apart - 360.0 * np.round(np.median(apart) / 360.0)
        if name == "psi" and not np.abs(apart).max() < 4.0:
            return f"{name} {np.abs(apart).max()}"
        if name == "delta" and name in trial and not np.abs(apart).max() < 4.0:
            return f"{name} {np.abs(apart).max()}"
    if guess.side and guess.side.side == ("port" if sign > 0 else "starboard"):
        return "side"
    if (
        "u" in trial
        and abs(np.median(np.hypot(trial["u"], trial.channels.get("v", 0.0))) - 7.0)
        > 1.0
    ):
        return (
            "" if any("is a guess" in one.reason for one in guess.columns) else "speed"
        )
    return ""


@pytest.mark.parametrize("seed", range(20))
def test_no_table_is_read_wrong_in_silence(tmp_path, seed):
    text, sign = written(seed)
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    assert wrong_in_silence(guess_trial(tmp_path / "log.csv"), sign) == ""
