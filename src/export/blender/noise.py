FINE = 3  # samples to a coefficient in the pictures
SIDE = 256  # coefficients along the side of a tile


def drawn(coefficients):
    """Return a tile's quadratic spline surface as the samples of a cubic one, along columns."""
    fine = np.empty((SIDE, FINE, coefficients.shape[1]))
    for k in range(FINE):
        # From the nearest coefficient.
        beyond = int(2 * k > FINE)
        t = k / FINE - beyond
        near = np.roll(coefficients, -beyond, axis=0)
        first = 0.5 * (0.5 - t) ** 2
        last = 0.5 * (0.5 + t) ** 2
        fine[:, k] = (1 - first - last) * near
        fine[:, k] += first * np.roll(near, 1, axis=0) + last * np.roll(near, -1, axis=0)
    fine = fine.reshape(SIDE * FINE, -1)
    # The cubic spline through these values: its filter undone on the torus.
    turn = 2 * np.pi * np.fft.rfftfreq(SIDE * FINE)
    spectrum = np.fft.rfft(fine, axis=0) * (3 / (2 + np.cos(turn)))[:, None]
    return np.fft.irfft(spectrum, SIDE * FINE, axis=0)


def surface(tile, shifts):
    """Return a tile's surface, moved differently in red, green and blue."""
    coefficients = numbers(tile["coefficients"], "<i2", SIDE, SIDE) * tile["scale"]
    upright = drawn(drawn(coefficients).T).T
    moved = [np.roll(upright, (-y * FINE, -x * FINE), axis=(0, 1)) for x, y in shifts]
    return np.stack(moved, axis=2)


def noise_of(graph, group, place, bands, images):
    """Return the sum of a group's bands."""
    total = (0, 0, 0)
    for band, weights, offset in zip(bands, group["weights"], group["offsets"]):
        if not any(weights):
            continue
        at = graph.vector("DIVIDE", place, (*band["span"], 1))
        at = graph.vector("ADD", at, (*offset, 0))
        noise = graph.lookup(images[band["tile"]], at, "noise", "Cubic")
        total = graph.vector("MULTIPLY_ADD", noise, weights, total)
    return total


def noises(graph, texture, place):
    """Return the noise of each group of channels at a place in pixels, v up."""
    images = [
        picture(f"{texture['name']} noise {i}", surface(tile, texture["shifts"]))
        for i, tile in enumerate(texture["tiles"])
    ]
    if texture["turn"]:
        x, y = (graph.vector("DOT_PRODUCT", place, (*row, 0)) for row in texture["turn"])
        place = graph.combined(x, y, 0, label="turned")
    return [noise_of(graph, part, place, texture["bands"], images) for part in texture["groups"]]
