// Volumes in memory: levels, residency, and where files lie.
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEngine;

static class Volumes
{
    /// <summary>The level that the importer takes of a tile's boxes, and the most memory that it takes then.</summary>
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

    /// <summary>Items [name, bytes] that are wanted one after another, with a budget of 100. Returns who leaves, and who stays.</summary>
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

    /// <summary>The path of a file in a player whose streaming assets lie at an address, at each look.</summary>
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
