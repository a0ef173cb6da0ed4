"""What a proxy is worth as a teacher: the learning experiment and the search for the best teacher."""
