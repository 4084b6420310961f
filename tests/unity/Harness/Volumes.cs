// Returns the importer's levels, the tiles that stay in memory, and the paths of voxel files.
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEngine;

static class Volumes
{
    /// <summary>Return the level that the importer chooses for a tile's boxes, and its peak memory.</summary>
    public static JToken LevelFor(JObject asked)
    {
        var options = asked["options"].ToObject<ImportOptions>();
        var boxes = asked["boxes"].Select(box => new KeyValuePair<int[][], int>(box["levels"].ToObject<int[][]>(), (int)box["channels"])).ToList();
        var level = options.LevelFor(boxes);
        var sizes = boxes.Select(box => new KeyValuePair<int[], int>(box.Key[level], box.Value)).ToArray();
        return new JObject(
            new JProperty("level", level),
            new JProperty("peak", VolumeMemory.PeakBytes(sizes)),
            new JProperty("textures", sizes.Sum(size => VolumeMemory.TextureBytes(size.Key, size.Value))));
    }

    /// <summary>Request items [name, bytes] one after another with a budget of 100 bytes. Returns for each request the
    /// items that leave, the items that stay, and their bytes.</summary>
    public static JToken Residents(JArray wanted)
    {
        var residency = new Residency<string> { Budget = 100 };
        var found = new JArray();
        foreach (var each in wanted)
        {
            var leaving = residency.Admit(string.Intern((string)each[0]), (long)each[1]);
            found.Add(new JArray(new JArray(leaving), new JArray(residency.Items), residency.Bytes));
        }
        return found;
    }

    /// <summary>Check four times whether a voxel file is available in a player whose streaming assets lie at an address.
    /// Returns the path and the error each time.</summary>
    public static JToken Place(string address, string file)
    {
        VolumePlace.Maker = null;
        Application.isPlaying = true;
        Application.streamingAssetsPath = address;
        Application.temporaryCachePath = "cache";
        var box = new GameObject("box").AddComponent<VolumeBox>();
        box.file = file;
        var found = new JArray();
        using (var place = VolumePlace.Of(box))
        {
            for (var look = 0; look < 4; look++)
            {
                found.Add(new JArray(place.Path, place.Error));
                place.Advance();
            }
        }
        return found;
    }
}
