"""The weather by rain and by range: shares of rain, visibility, reach, an alarm.

A ray ends at the first drop that it meets, or else at the last thing that it meets. Counts of rays
by where they end and at what are all that is kept of a scan; they add up over scans.

Visibility comes from the rays that end at rain by a method. Reach, the range within which 99 % of
the rays end, comes from all of them: beside dry scans of the same sensor it shows what rain and fog
take of the range without a return of their own.

What the figures are not: a LiDAR sees drops only as far as they return enough light, often ten to
thirty metres, and rays that bring nothing back are not counted, for most of them went to the sky.
So they compare scans of one sensor with one another, and show nothing of what a person or a weather
station would see.
"""
