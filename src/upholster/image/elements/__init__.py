"""The structure of a sample: the waves at which it repeats, and the joints between its stones or boards.

`lattice` finds waves, how certain they are, and their phase at every pixel (`find_lattice`). `planes`
computes the planes that are examined, `autocorrelation` how alike they and their shifted copies are.
`translations` finds two translations after which a sample is alike, `bases` the shortest two of a lattice,
`rows` the distance of even rows. `wave_phases` finds a wave's own phase everywhere. `joints` finds thin
lines, and the distance of each pixel from the nearest (`find_joints`). `courses` finds which waves count
courses, where elements are in running bond (`find_courses`).
"""
