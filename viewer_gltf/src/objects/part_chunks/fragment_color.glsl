diffuseColor.rgb = objectColor(diffuseColor.rgb);
