"""What fields on blocks share: heat in elements, fluid in joints, proppant in it, moisture of soil."""
