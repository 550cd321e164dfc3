"""The machine: its cores, processes, clocks, libraries, and notices on its terminal."""
