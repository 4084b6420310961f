transformed = objectPlace(transformed);
