"""How bad the weather is, by what a method calls rain in a scan: shares, visibility, an alarm.

A ray ends at the first drop that it meets, or else at the last thing that it meets. Counts of rays
by where they end and at what are all that is kept of a scan; they add up over scans.

What the figures are not: a LiDAR sees drops only as far as they return enough light, often ten to
thirty metres, and rays that bring nothing back are not counted, for most of them went to the sky.
So they compare scans of one sensor with one another, and say nothing of what a person or a weather
station would see.
"""
