"""
Most starts of a hundred chaotic oscillators escape
===================================================

Menck, Heitzig, Marwan & Kurths, Nature Physics 9, 89 (2013).

A hundred Rössler oscillators (0.2, 0.2, 7) with links x → x form a small world: each has eight neighbours on a ring,
and 86 of the 400 links are rewired at one end.  The synchronous state is linearly stable in a range of strengths K.
Each oscillator starts at random in [-15, 15]² × [-5, 35].  The paper counts how many of 500 starts reach the
synchronous state.  The shares are between 0.226 and 0.694 and grow with K.

Links, eigenvalues and shares are taken from the case study of pyBasin (github.com/adrianwix/pyBasin).  The eigenvalues
confirm the links.  In our runs, all other starts escape to infinity.  Three standard errors of the random starts count
as agreement.

The published zeros of the master stability function, 0.1232 and 4.663, are not compared.  Ours are 0.139 ± 0.003 and
4.478 ± 0.005.  Runge-Kutta steps over 60 000 units of time confirm that the exponents at the published zeros are
positive (0.0100 ± 0.0005 and 0.0078 ± 0.0001).
"""

import numpy as np

import synchain as sc

rewired = """
3:61 4:91 8:20 18:73 24:88 25:45 44:93 46:3 52:49 63:65 67:94 73:65 81:16 86:0 92:47 95:75 97:34 98:17 99:90 102:8
113:46 114:36 116:70 127:52 130:6 131:48 146:73 150:84 155:93 157:46 159:13 162:86 167:67 170:77 171:95 181:60 183:75
191:96 195:34 208:28 209:21 211:83 212:1 214:88 215:88 216:79 219:78 220:85 230:45 234:36 235:75 236:71 239:12 240:33
243:7 251:77 254:74 255:47 258:95 259:19 279:14 282:18 283:16 292:47 295:56 296:10 304:10 306:97 314:93 322:30 326:14
331:52 332:50 336:51 337:72 351:12 356:97 357:25 360:10 361:65 364:54 366:15 376:18 383:59 387:34 388:60
"""  # number of the link: new end
links = [(node, (node + step) % 100) for node in range(100) for step in range(1, 5)]
for number, end in (map(int, entry.split(":")) for entry in rewired.split()):
    links[number] = links[number][1], end
world = sc.graphs.from_edges([(a + 1, b + 1) for a, b in links])
slow, fast = np.sort(np.abs(world.spectrum.values))[[1, -1]]
rossler = sc.Field({"x": "-y - z", "y": "x + 0.2*y", "z": "0.2 + z*(x - 7)"}, initial={"x": 1, "y": 1, "z": 1})
scene = sc.Scene(rossler, "x->x", world, time_unit="time", transient=400, window=20, rtol=1e-6)
ranges = {"x": (-15, 15), "y": (-15, 15), "z": (-5, 35)}
printed = {0.218: 0.496, 0.297: 0.694}
basin = sc.basin(scene, sigma=[*printed], samples=250, ranges=ranges, bound=400)
bounded = 1 - basin.shares.sel(attractor="escaped").values
claims = {"least eigenvalue": (1.236, slow, 5e-4), "largest eigenvalue": (13.87125, fast, 5e-6)}
for (K, share), found in zip(printed.items(), bounded, strict=True):
    error = np.sqrt(share * (1 - share) * (1 / 500 + 1 / 250))
    claims[f"share of starts at K = {K}"] = share, found, 3 * error
reproduction = sc.results.Reproduction(claims)
print(reproduction)
basin.plot()
