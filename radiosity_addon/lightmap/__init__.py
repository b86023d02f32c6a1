"""From triangles to lightmap pages and back: charts, packing, texels, dilation, encoding."""
