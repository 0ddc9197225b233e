SIDE = 32  # rows and columns of vertices before they repeat

# A triangular lattice lies over the plane. Each of its vertices shows a part of the photo, and a
# point blends those of the three vertices around it. Neighbors differ in their color, 0, 1 or 2.
# Vectors hold a number for each color: so what a color looks up changes only where its weight is 0.


def pictures(texture):
    """Return images of what each vertex shows and how alike neighbors are, and of the photo."""
    name, tiling = texture["name"], texture["tiling"]
    choices, alike = (numbers(tiling[key], np.uint8, SIDE, SIDE, 3) for key in ("choices", "alike"))
    width, height = tiling["size"]
    inputs = [
        (numbers(text, "<u2", height, width, tiling["together"]) - 32768) / 8192
        for text in tiling["inputs"]
    ]
    table = [picture(f"{name} places", choices), picture(f"{name} alike", alike / 255)]
    return table, [picture(f"{name} input {i}", rows) for i, rows in enumerate(inputs)]


def power(graph, value, exponent):
    """Return a vector multiplied by itself."""
    total = None
    while exponent:
        if exponent % 2:
            total = value if total is None else graph.vector("MULTIPLY", total, value)
        exponent //= 2
        if exponent:
            value = graph.vector("MULTIPLY", value, value)
    return total


def cells(graph, tiling, place):
    """Return the corner of a place's cell, and the way from there, along the lattice's axes."""
    x, y, _ = graph.parts(place)
    (a, b), top = tiling["cell"], tiling["top"]
    v = graph.number("MULTIPLY_ADD", y, -1 / b, top, label="v")
    u = graph.number("DIVIDE", x, a)
    u = graph.number("MULTIPLY_ADD", v, -0.5, u, label="u")
    corner = [graph.number("FLOOR", axis) for axis in (u, v)]
    return corner, [graph.number("SUBTRACT", *axis) for axis in zip((u, v), corner)]


def steps(graph, corner, way):
    """Return the steps from a cell's corner to the vertex of each color."""
    # 0.5, 1.5 or 2.5 instead of 0, 1 or 2: so rounding does not matter.
    which = graph.number("SUBTRACT", *corner, label="color")
    which = graph.vector("SUBTRACT", (0.5, 1.5, 2.5), which)
    turns = graph.vector("DIVIDE", which, (3, 3, 3))
    turns = graph.vector("FLOOR", turns)
    which = graph.vector("MULTIPLY_ADD", turns, (-3, -3, -3), which, label="which")
    near = graph.vector("SUBTRACT", (1.5, 1.5, 1.5), which)
    near = graph.vector("MAXIMUM", near, (0, 0, 0), label="near or far corner")
    below = graph.vector("SUBTRACT", which, (1.5, 1.5, 1.5))
    below = graph.vector("MAXIMUM", below, (0, 0, 0), label="below")
    far = graph.number("ADD", *way)
    far = graph.number("GREATER_THAN", far, 1, label="far half")
    far = graph.vector("MULTIPLY", near, far, label="far corner")
    right = graph.vector("ADD", near, below)
    right = graph.vector("SUBTRACT", (1, 1, 1), right, label="right")
    return [graph.vector("ADD", step, far, label="steps") for step in (right, below)]


def weights(graph, x, y, sharpness):
    """Return the weight of each color, and along three ways that of the next color's vertex."""
    z = graph.vector("ADD", x, y)
    longest = (0, 0, 0)
    for way in (x, y, z):
        length = graph.vector("ABSOLUTE", way)
        longest = graph.vector("MAXIMUM", length, longest)
    weight = graph.vector("SUBTRACT", (1, 1, 1), longest, label="weight")
    minus_x, minus_y, minus_z = (graph.vector("MULTIPLY", w, (-1, -1, -1)) for w in (x, y, z))
    following = []
    for one, other in ((x, z), (minus_y, minus_z), (minus_x, y)):
        along = graph.vector("MINIMUM", one, other)
        along = graph.vector("MAXIMUM", along, (0, 0, 0), label="weight of the next")
        following.append(power(graph, along, sharpness))
    return power(graph, weight, sharpness), following


def shares(graph, weight, following, table, alike):
    """Return the share of each color: tiles are standard normal numbers, and so is their sum."""
    pairs = []
    for at, *along in zip(table, *(graph.parts(ways) for ways in following)):
        likeness = graph.lookup(alike, at, "alike", "Closest")
        pairs.append(graph.vector("DOT_PRODUCT", graph.combined(*along), likeness, label="pair"))
    pairs = graph.combined(*pairs)
    pairs = graph.vector("MULTIPLY_ADD", pairs, (2, 2, 2), weight)
    variance = graph.vector("DOT_PRODUCT", weight, pairs, label="variance")
    deviation = graph.number("SQRT", variance)
    return graph.vector("DIVIDE", weight, deviation, label="shares")


def noises(graph, texture, place):
    """Return the blend of each group of channels at a place in pixels, v up."""
    tiling = texture["tiling"]
    (places, alike), inputs = pictures(texture)
    corner, way = cells(graph, tiling, place)
    right, down = steps(graph, corner, way)
    x, y = (graph.vector("SUBTRACT", *axis) for axis in zip(way, (right, down)))
    weight, following = weights(graph, x, y, tiling["sharpness"])

    # The table's row 0 is on top, and it repeats.
    table = []
    for first, step, side in zip(corner, (right, down), (SIDE, -SIDE)):
        vertex = graph.vector("ADD", step, first, label="vertex")
        middle = graph.vector("ADD", vertex, (0.5, 0.5, 0.5))
        table.append(graph.parts(graph.vector("DIVIDE", middle, (side,) * 3)))
    table = [graph.combined(*at, 0, label="in the table") for at in zip(*table)]
    share = graph.parts(shares(graph, weight, following, table, alike))

    (width, height), (a, b) = tiling["size"], tiling["cell"]
    x = graph.vector("MULTIPLY_ADD", y, (0.5, 0.5, 0.5), x)
    ways = [graph.vector("MULTIPLY", w, (n,) * 3, label="pixels") for w, n in ((x, a), (y, b))]
    totals = [(0, 0, 0)] * len(inputs)
    for at, amount, *pixels in zip(table, share, *(graph.parts(w) for w in ways)):
        at = graph.lookup(places, at, "place", "Closest")
        at = graph.vector("MULTIPLY_ADD", at, (*tiling["step"], 0), (*tiling["first"], 0))
        at = graph.vector("ADD", at, graph.combined(*pixels, 0))
        # Rows are counted from the top, v from the bottom.
        at = graph.vector("MULTIPLY_ADD", at, (1 / width, -1 / height, 0), (0, 1, 0))
        for i, image in enumerate(inputs):
            tile = graph.lookup(image, at, "tile", "Linear", "EXTEND")
            totals[i] = graph.vector("MULTIPLY_ADD", tile, amount, totals[i])
    return [
        graph.vector("MULTIPLY", total, part["weights"][0])
        for total, part in zip(totals, texture["groups"])
    ]
