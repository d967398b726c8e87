"""The pointer of the source, counted from 0 and stopped at the last particle that has a weight."""


def systematic_resample(ws, offset):
    """Walk along the ruler once."""
    ws = [float(w) for w in ws]
    size, total = len(ws), 0.0
    for w in ws:
        total += w
    last = max(i for i, w in enumerate(ws) if w > 0)
    taken, i, mark = [], 0, ws[0]
    for j in range(size):
        tooth = (offset + j / size) * total
        while mark <= tooth and i < last:
            i += 1
            mark += ws[i]
        taken.append(i)
    return taken
