// Runs the package's code with the stubs, and prints the result as JSON.
using System;
using System.IO;
using System.Reflection;
using Newtonsoft.Json;
using Newtonsoft.Json.Linq;
using StereoCell.Editor;

static class Program
{
    static int Main(string[] args)
    {
        try
        {
            // Unity runs the static constructors of [InitializeOnLoad] classes when the editor starts.
            System.Runtime.CompilerServices.RuntimeHelpers.RunClassConstructor(typeof(BundleWatcher).TypeHandle);
            System.Runtime.CompilerServices.RuntimeHelpers.RunClassConstructor(typeof(VolumeCache).TypeHandle);
            if (args[0] == "zstd") Unpacking.Unpack();
            else if (args[0] == "ktx2") Unpacking.Level(args[1], int.Parse(args[2]));
            else if (args[0] == "voxels") Unpacking.Voxels(args[1]);
            else Console.WriteLine(JsonConvert.SerializeObject(Answer(args)));
            return 0;
        }
        catch (Exception error) when (error is IOException || error is InvalidDataException)
        {
            Console.Error.WriteLine(error.Message);
            return 1;
        }
    }

    static JToken Answer(string[] args)
    {
        switch (args[0])
        {
            case "import": return Importing.Import(args[1], JObject.Parse(args[2]));
            case "asset": return Importing.Asked(args[1]);
            case "changes": return Importing.Changes(args[1], args[2], args[3]);
            case "tests": return Importing.Tests(float.Parse(args[1]));
            case "build": return Importing.Build(args[1]);
            case "heights": return Placing.Heights(args);
            case "sort": return Placing.Sort(JArray.Parse(args[1]), JArray.Parse(args[2]));
            case "drawer": return Placing.Drawer();
            case "gaze": return Gazing.Gaze(JArray.Parse(args[1]));
            case "tour": return Gazing.Tour(JObject.Parse(args[1]));
            case "sample": return Gazing.Sample(args[1]);
            case "level": return Volumes.LevelFor(JObject.Parse(args[1]));
            case "residency": return Volumes.Residents(JArray.Parse(args[1]));
            case "place": return Volumes.Place(args[1], args[2]);
            case "points": return Functions.Points(JArray.Parse(Console.In.ReadToEnd()));
            case "layer": return Functions.Layer(args[1], args[2], args[3], JArray.Parse(args[4]));
            default: throw new ArgumentException(args[0]);
        }
    }

    /// <summary>Call a method that Unity calls by its name, such as Update or OnEnable.</summary>
    public static void Send(object component, string message)
    {
        component.GetType().GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(component, null);
    }
}
