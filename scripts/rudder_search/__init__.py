"""Search of rudder commands on the true ship, the weather to come known."""
